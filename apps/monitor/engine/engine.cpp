// SPDX-License-Identifier: MIT
#include "monitor/engine/engine.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "monitoring/alarm_text.hpp"

namespace resonid::monitor {
namespace {

using monitoring::ActionKind;
using monitoring::AxisMonitor;
using monitoring::Phase;
using Clock = std::chrono::steady_clock;
using std::chrono::duration;

constexpr double kNs = 1e9;
constexpr std::size_t kMostSamples = 4096;  // of an axis before the next axis has its turn
constexpr double kOverdue = 3.0;            // samples
constexpr auto kIdle = std::chrono::milliseconds(2);
constexpr auto kHandOver = std::chrono::milliseconds(50);
constexpr std::size_t kMostActions = 1000;  // that wait for an axis
constexpr std::uint64_t kFirstPlace = 1;    // among those that wait to learn
constexpr int kLearningNice = 5;            // learning may wait, following may not

/// What one thread gives and others take; a few times a second. In place of std::atomic<std::shared_ptr>,
/// whose readers release their lock in relaxed order in GCC 12: a race where the machine reorders.
template <class T>
class Exchanged {
 public:
  [[nodiscard]] std::shared_ptr<T> load() const {
    const std::scoped_lock lock(mutex_);
    return value_;
  }
  void store(std::shared_ptr<T> value) {
    const std::scoped_lock lock(mutex_);
    value_.swap(value);  // the former one is destroyed after the lock
  }

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<T> value_;
};

std::string local_time_text(std::int64_t ns) {
  const auto seconds = static_cast<std::time_t>(ns / 1'000'000'000);
  return fmt::format("{:%Y-%m-%d %H:%M:%S %z}", fmt::localtime(seconds));
}

}  // namespace

double stale_after_s(const EngineOptions& options, double sample_rate_hz) {
  return std::max(options.stale_s, kOverdue / sample_rate_hz);
}

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

class Engine::Impl {
 public:
  Impl(std::vector<Axis> axes, EngineOptions options) : options_(std::move(options)) {
    if (!options_.time_text) options_.time_text = local_time_text;
    const std::size_t cores = std::max(1U, std::thread::hardware_concurrency());
    if (options_.workers == 0) options_.workers = cores;
    if (options_.learners == 0) options_.learners = (cores + 1) / 2;
    for (auto& axis : axes) slots_.push_back(std::make_unique<Slot>(std::move(axis)));
    for (std::size_t i = 0; i < slots_.size(); ++i) {
      Slot& s = *slots_[i];
      s.position = s.snapshot_position = s.ring->position_of(s.monitor.next_sample());
      s.ring->set_read(s.position);
      s.timing = {s.monitor.next_sample(), s.ring->next_time_ns().value_or(now_ns()),
                  kNs / s.monitor.spec().sample_rate_hz};
      if (options_.on_row) s.out.on_row = [this, i](const AxisMonitor& m) { options_.on_row(i, m); };
      publish(s, true);
    }
    const std::size_t workers = std::max<std::size_t>(1, std::min(options_.workers, slots_.size()));
    for (std::size_t w = 0; w < workers; ++w) workers_.push_back(std::make_unique<Worker>());
    for (std::size_t i = 0; i < slots_.size(); ++i) workers_[i % workers]->axes.push_back(i);
  }
  ~Impl() { stop(0.0); }

  void start() {
    started_ = Clock::now();
    // What took its time before is not silence.
    for (auto& slot : slots_) slot->progress = slot->silent_until = started_;
    for (std::size_t i = 0; i < slots_.size(); ++i)  // spread over the time between two of one axis
      if (!slots_[i]->snapshot_useful)
        slots_[i]->snapshot_due =
            started_ + seconds(options_.snapshot_every_s * (1.0 + static_cast<double>(i)) /
                               static_cast<double>(slots_.size()));
    for (auto& worker : workers_) worker->begun.store(started_);
    for (std::size_t i = 0; i < options_.learners; ++i) threads_.emplace_back([this] { learn(); });
    for (auto& worker : workers_) threads_.emplace_back([this, &w = *worker] { work(w); });
  }

  void stop(double drain_s) {
    if (threads_.empty()) return;
    drain_until_ = Clock::now() + seconds(drain_s);
    ending_.store(true);
    for (auto& slot : slots_) {  // what was promised is in its list
      const std::scoped_lock lock(slot->asked_mutex);
    }
    stopping_.store(true);
    { const std::scoped_lock lock(learning_mutex_); }
    learning_.notify_all();
    for (auto& thread : threads_) thread.join();
    threads_.clear();
  }

  std::vector<Results> take() {
    std::vector<Results> all;
    for (auto& worker : workers_) {
      const std::unique_ptr<std::vector<Results>> some(
          worker->out.exchange(nullptr, std::memory_order_acq_rel));
      if (some) std::move(some->begin(), some->end(), std::back_inserter(all));
    }
    return all;
  }

  void stored(std::size_t axis, std::uint64_t position) {
    slots_[axis]->stored.store(position, std::memory_order_release);
  }
  void keep_going(bool without_store) { without_store_.store(without_store); }

  expected<void, Error> act(std::size_t axis, Told told, std::optional<double> seconds_from_now) {
    Slot& s = *slots_[axis];
    const std::scoped_lock lock(s.asked_mutex);
    if (ending_.load()) return tl::unexpected(Error{"action", "the service is ending; try again later"});
    if (s.asked.size() >= kMostActions)
      return tl::unexpected(Error{"action", "the axis has too many actions to take in; try again later"});
    s.asked.push_back({std::move(told), seconds_from_now});
    s.has_asked.store(true, std::memory_order_release);
    return {};
  }

  [[nodiscard]] std::shared_ptr<const LiveAxis> live(std::size_t axis) const {
    return slots_[axis]->live.load();
  }
  [[nodiscard]] std::size_t axes() const noexcept { return slots_.size(); }
  [[nodiscard]] std::uint64_t revision() const noexcept { return revision_.load(); }
  [[nodiscard]] double busy() const noexcept {
    const double passed = duration<double>(Clock::now() - started_).count();
    return passed > 0.0 ? static_cast<double>(busy_ns_.load()) / kNs / passed : 0.0;
  }
  [[nodiscard]] double turn_s() const noexcept {
    if (stopping_.load()) return 0.0;
    Clock::duration longest{};
    const auto now = Clock::now();
    for (const auto& worker : workers_) longest = std::max(longest, now - worker->begun.load());
    return duration<double>(longest).count();
  }

 private:
  struct Asked {
    Told told;
    std::optional<double> seconds;  // from the sample on at which it is taken
  };
  struct Slot {
    explicit Slot(Axis axis)
        : monitor(std::move(axis.monitor)),
          ring(axis.ring),
          replayed(axis.actions.begin(), axis.actions.end()),
          next_action(monitor.last_action() + 1),
          snapshot_useful(axis.begins_anew) {
      for (const auto& told : replayed) next_action = std::max(next_action, told.action.id + 1);
      if (monitor.facts().stale) stopped_at = monitor.facts().sample;
      find_next_end();
    }
    void find_next_end() {
      next_end_ns = monitor.alarms().maintenance_until_ns();
      for (std::size_t i = 0; i < monitoring::kAlarms; ++i) {
        const std::int64_t end = monitor.alarms()[monitoring::AlarmId::of(i)].shelved_until_ns;
        if (end != 0 && (next_end_ns == 0 || end < next_end_ns)) next_end_ns = end;
      }
    }
    AxisMonitor monitor;
    Ring* ring;
    std::deque<Told> replayed;  // actions taken before, by sample
    std::uint64_t next_action;
    std::int64_t next_end_ns = 0;  // of maintenance or shelving, UNIX time; 0: none
    std::uint64_t position = 0, snapshot_position = 0;
    monitoring::Output out;
    Results results;
    Clock::time_point snapshot_due, publish_due, curve_due, progress = Clock::now();
    Clock::time_point silent_until = Clock::now(), reminded = Clock::now();
    struct {
      std::uint64_t sample = 0;
      std::int64_t time_ns = 0;
      double interval_ns = 0.0;
    } timing;  // of the newest samples
    [[nodiscard]] std::int64_t time_of(std::uint64_t sample) const {
      const double since = static_cast<double>(sample) - static_cast<double>(timing.sample);
      return timing.time_ns + std::llround(since * timing.interval_ns);
    }
    struct By {
      std::size_t event = 0;
      std::string who, reason;
      std::uint64_t action = 0;
      std::int64_t time_ns = 0;
    };
    std::vector<By> by;  // whose events those are
    std::int64_t newest_ns = 0, processed_ns = 0, row_ns = 0;
    bool snapshot_useful = false, changed = false, silent = false;
    std::uint64_t stopped_at = 0;  // `stale` ends with this sample: former ones come again to be learned from
    std::atomic<bool> learning{false};  // a learner has it, or is to
    std::uint64_t place = 0;            // among those that wait to learn; 0: it does not
    Clock::time_point waits_since;
    std::atomic<std::uint64_t> stored{0};
    Exchanged<const LiveAxis> live;
    std::shared_ptr<const monitoring::ResponseCurve> curve;
    std::int64_t curve_ns = 0;

    std::atomic<bool> has_asked{false};
    std::mutex asked_mutex;
    std::vector<Asked> asked;
  };
  struct Worker {
    ~Worker() { delete out.load(); }
    std::vector<std::size_t> axes;
    std::atomic<std::vector<Results>*> out{nullptr};  // for take()
    Clock::time_point handed_over{};
    std::atomic<Clock::time_point> begun{Clock::now()};  // the present turn
  };

  static Clock::duration seconds(double s) {
    return std::chrono::duration_cast<Clock::duration>(duration<double>(s));
  }

  void work(Worker& worker) {
    while (true) {
      const bool stopping = stopping_.load();  // all that was asked before has its turn once more
      const auto begin = Clock::now();
      std::size_t taken = 0;
      worker.begun.store(begin);
      for (const std::size_t i : worker.axes) {
        taken += advance(i, begin);
        worker.begun.store(Clock::now());
      }
      const bool drained = taken == 0 || (stopping && begin > drain_until_);  // which is set before that
      const auto is_told = [this](std::size_t i) { return is_asked(*slots_[i]); };
      // What an axis was told while a learner had it has its turn when that is done.
      if (stopping && drained && std::none_of(worker.axes.begin(), worker.axes.end(), is_told)) break;
      hand_over(worker, begin, false);
      busy_ns_.fetch_add(std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now() - begin).count(),
                         std::memory_order_relaxed);
      if (taken == 0) std::this_thread::sleep_for(kIdle);
    }
    for (const std::size_t i : worker.axes)
      if (!slots_[i]->learning.load(std::memory_order_acquire)) make_snapshot(*slots_[i], Clock::now());
    hand_over(worker, Clock::now(), true);
  }

  /// One axis' turn; samples taken.
  std::size_t advance(std::size_t index, Clock::time_point now) {
    Slot& s = *slots_[index];
    if (s.learning.load(std::memory_order_acquire)) {
      if (!waits_too_long(s, now) || !withdraw(s)) return 0;
      gather_anew(s, now);
    }
    release(s);
    if (s.monitor.phase() == Phase::learning && gathered_then(s)) take_actions(s);
    // Nobody learns any more: what a person did would be lost.
    if (s.monitor.phase() == Phase::learning && stopping_.load() && is_asked(s)) gather_anew(s, now);
    if (s.monitor.phase() == Phase::learning) {
      begin_learning(s, now);
      return 0;
    }
    take_actions(s);
    const std::size_t taken = take_samples(s);
    if (taken > 0) {
      s.progress = now;
      s.snapshot_useful = true;
    }
    watch_staleness(s, now);
    end_what_is_over(s);
    collect(index, s);
    if (now >= s.publish_due) publish(s, now >= s.curve_due);
    if (snapshot_is_due(s, now)) make_snapshot(s, now);
    return taken;
  }

  void release(Slot& s) {
    const std::uint64_t to = without_store_.load(std::memory_order_relaxed)
                                 ? s.position
                                 : s.stored.load(std::memory_order_acquire);
    if (to > s.ring->read()) s.ring->set_read(to);
  }

  static std::size_t take_samples(Slot& s) {
    const auto piece = s.ring->piece(s.position, kMostSamples);
    if (piece.samples == 0) return 0;
    if (piece.first_sample > s.monitor.next_sample())
      s.monitor.miss(piece.first_sample - s.monitor.next_sample());
    const std::size_t most = std::min(piece.samples, most_samples(s)) * s.ring->channels();
    const std::size_t taken = s.monitor.add(piece.values.first(most), s.out);
    s.position = piece.position + taken;
    const double interval_ns =
        piece.interval_ns > 0.0 ? piece.interval_ns : kNs / s.monitor.spec().sample_rate_hz;
    // Without a sender's clock the newest sample in the ring is as old as now.
    const std::int64_t first_ns =
        piece.time_ns
            ? *piece.time_ns
            : now_ns() -
                  std::llround(static_cast<double>(s.ring->next_sample() - piece.first_sample) * interval_ns);
    s.timing = {piece.first_sample, first_ns, interval_ns};
    s.processed_ns = now_ns();
    s.newest_ns = s.time_of(s.monitor.next_sample() - 1);
    return taken;
  }
  /// Until the next action that was taken before.
  static std::size_t most_samples(const Slot& s) {
    if (s.replayed.empty()) return kMostSamples;
    const std::uint64_t next = s.monitor.next_sample(), at = s.replayed.front().action.sample;
    return at > next ? static_cast<std::size_t>(std::min<std::uint64_t>(kMostSamples, at - next))
                     : kMostSamples;
  }

  void begin_learning(Slot& s, Clock::time_point now) {
    s.waits_since = now;
    publish(s, false, true);
    s.learning.store(true, std::memory_order_release);
    {
      const std::scoped_lock lock(learning_mutex_);
      // Who repeats what a former process did comes first, as it cannot take newer samples instead; who
      // gathered anew keeps its place.
      if (!s.replayed.empty())
        s.place = kFirstPlace;
      else if (s.place == 0)
        s.place = ++places_;
      const auto after = std::find_if(to_learn_.begin(), to_learn_.end(),
                                      [&s](const Slot* other) { return other->place > s.place; });
      to_learn_.insert(after, &s);
    }
    learning_.notify_one();
  }
  [[nodiscard]] bool waits_too_long(const Slot& s, Clock::time_point now) const {
    // A former process learned here: actions of its that follow would not count behind another one.
    if (!s.replayed.empty()) return false;
    if (is_asked(s) && stopping_.load()) return true;
    // Beyond that there may be no room for the longest message.
    const bool fills = s.ring->end() - s.ring->read() > s.ring->settings().capacity / 2;
    return (fills || is_asked(s)) &&
           duration<double>(now - s.waits_since).count() >= options_.learning_patience_s;
  }
  /// Whether a person's actions wait, which can be taken in now.
  [[nodiscard]] static bool is_asked(const Slot& s) {
    return s.has_asked.load(std::memory_order_acquire) && s.replayed.empty();
  }
  void gather_anew(Slot& s, Clock::time_point now) {
    act_as_service(s, {0, ActionKind::gather});
    s.snapshot_useful = true;  // which lets go of the samples of the stretch
    s.snapshot_due = now;
  }
  /// Whether it was still waiting.
  [[nodiscard]] bool withdraw(Slot& s) {
    const std::scoped_lock lock(learning_mutex_);
    const bool waited = std::erase(to_learn_, &s) > 0;
    if (waited) s.learning.store(false, std::memory_order_release);
    return waited;
  }
  /// Whether a former process came to the same here.
  [[nodiscard]] static bool gathered_then(const Slot& s) {
    return !s.replayed.empty() && s.replayed.front().action.kind == ActionKind::gather &&
           s.replayed.front().action.sample == s.monitor.next_sample();
  }
  void learn() {
#ifdef __linux__  // where it is the thread's alone
    static_cast<void>(::setpriority(PRIO_PROCESS, 0, kLearningNice));
#endif
    std::unique_lock lock(learning_mutex_);
    while (true) {
      learning_.wait(lock, [this] { return stopping_.load() || !to_learn_.empty(); });
      if (stopping_.load()) break;
      Slot& s = *to_learn_.front();
      to_learn_.pop_front();
      lock.unlock();
      publish(s, false);  // it waits no more
      s.monitor.learn();
      // Who needs more samples keeps it: the sooner some are done, the sooner there is time for the others.
      if (s.monitor.phase() != Phase::gathering) s.place = 0;
      s.learning.store(false, std::memory_order_release);
      lock.lock();
    }
    for (Slot* s : to_learn_) s->learning.store(false, std::memory_order_release);
    to_learn_.clear();
  }

  /// Actions taken before at their samples, then those that wait at the next one.
  void take_actions(Slot& s) {
    const auto next = [&] { return s.monitor.next_sample(); };
    while (!s.replayed.empty() && s.replayed.front().action.sample <= next()) {
      Told told = std::move(s.replayed.front());
      s.replayed.pop_front();
      told.action.sample = next();
      take_action(s, std::move(told), false);
    }
    if (!s.has_asked.load(std::memory_order_acquire) || !s.replayed.empty()) return;
    std::vector<Asked> asked;
    {
      const std::scoped_lock lock(s.asked_mutex);
      asked.swap(s.asked);
      s.has_asked.store(false, std::memory_order_release);
    }
    for (auto& one : asked) {
      one.told.action.sample = next();
      one.told.action.id = s.next_action++;
      if (one.seconds) {
        const double seconds = std::max(0.0, *one.seconds);
        one.told.action.until_sample =
            next() + static_cast<std::uint64_t>(std::llround(seconds * s.monitor.spec().sample_rate_hz));
        one.told.action.until_ns = one.told.time_ns + std::llround(seconds * kNs);
      }
      take_action(s, std::move(one.told), true);
    }
  }
  static void take_action(Slot& s, Told told, bool is_new) {
    const std::size_t before = s.out.events.size();
    if (!s.monitor.act(told.action, s.out)) return;
    if (told.action.kind == ActionKind::stop) s.stopped_at = s.monitor.next_sample();
    for (std::size_t i = before; i < s.out.events.size(); ++i)
      s.by.push_back({i, told.who, told.reason, told.action.id, told.time_ns});
    s.find_next_end();
    if (is_new) s.results.actions.push_back(std::move(told));
  }

  /// The alarm `stale`, whose delays are by the clock, as there are no samples to count.
  void watch_staleness(Slot& s, Clock::time_point now) {
    const auto& rule = s.monitor.spec().alarms.stale;
    const auto lasts = [now](Clock::time_point since, double seconds) {
      return duration<double>(now - since).count() >= seconds;
    };
    const double stale_s = stale_after_s(options_, s.monitor.spec().sample_rate_hz);
    s.silent = lasts(s.progress, stale_s);
    if (s.silent) s.silent_until = now;
    if (!s.replayed.empty() || s.monitor.phase() == Phase::learning) return;
    const bool told = s.monitor.facts().stale;
    const double longest_s =
        s.monitor.next_sample() > 0 ? stale_s : std::max(stale_s, options_.first_sample_s);
    if (!told && lasts(s.progress, longest_s + rule.on_delay_s)) {
      s.reminded = now;
      act_as_service(s, {0, ActionKind::stop});
    } else if (told && s.monitor.next_sample() > s.stopped_at && !s.silent &&
               lasts(s.silent_until, rule.off_delay_s)) {
      act_as_service(s, {0, ActionKind::resume});
    } else if (told && rule.realarm_s > 0.0 && lasts(s.reminded, rule.realarm_s)) {
      s.reminded = now;
      act_as_service(s, {0, ActionKind::remind, {monitoring::AlarmKind::stale, {}}});
    }
  }

  /// Maintenance and shelving end by the clock, too, as samples may not come meanwhile.
  void end_what_is_over(Slot& s) {
    if (s.next_end_ns == 0 || !s.replayed.empty() || s.monitor.phase() == Phase::learning) return;
    const std::int64_t now = now_ns();
    if (now < s.next_end_ns) return;
    const auto& alarms = s.monitor.alarms();
    const auto is_over = [now](std::int64_t end) { return end != 0 && end <= now; };
    if (is_over(alarms.maintenance_until_ns()))
      act_as_service(s, {0, ActionKind::maintenance, {}, s.monitor.next_sample()});
    for (std::size_t i = 0; i < monitoring::kAlarms; ++i)
      if (const auto id = monitoring::AlarmId::of(i); is_over(alarms[id].shelved_until_ns))
        act_as_service(s, {0, ActionKind::unshelve, id});
    s.find_next_end();
  }
  void act_as_service(Slot& s, monitoring::Action action) {
    action.sample = s.monitor.next_sample();
    action.id = s.next_action++;
    take_action(s, {action, now_ns(), "service", {}}, true);
  }

  [[nodiscard]] monitoring::AlarmWords words_of(std::size_t index, const Slot& s,
                                                const monitoring::AlarmEvent& event) const {
    monitoring::AlarmWords words;
    words.time = [this, &s](std::uint64_t sample) { return options_.time_text(s.time_of(sample)); };
    words.clock = options_.time_text;
    words.linear = s.monitor.spec().motion == data::Motion::linear;
    words.units = monitoring::figure_units(s.monitor.spec());
    // Known now alone: a text that is stored stays as it is.
    words.refused =
        event.alarm.kind == monitoring::AlarmKind::stale && options_.refused && options_.refused(index);
    return words;
  }

  /// What the monitor gave out, with its times, for the store.
  void collect(std::size_t index, Slot& s) {
    if (s.out.rows.empty() && s.out.events.empty() && s.results.actions.empty()) return;
    const double rate_hz = s.monitor.spec().sample_rate_hz;
    const double every = std::max(1.0, std::round(s.monitor.spec().row_every_s * rate_hz));
    for (const auto& row : s.out.rows) {
      const auto sample = static_cast<double>(row.sample);
      // The first of each second, whichever rows came before.
      if (std::floor(sample / rate_hz) != std::floor((sample - every) / rate_hz))
        s.results.rows.push_back({row, s.time_of(row.sample)});
    }
    if (!s.out.rows.empty()) s.row_ns = s.time_of(s.out.rows.back().sample);
    for (std::size_t i = 0; i < s.out.events.size(); ++i) {
      const auto& event = s.out.events[i];
      Results::TimedEvent timed;
      timed.event = event;
      timed.time_ns = s.time_of(event.sample);
      timed.since_ns = s.time_of(event.since_sample);
      for (const auto& by : s.by)
        if (by.event == i) {
          std::tie(timed.who, timed.reason, timed.action) = std::tie(by.who, by.reason, by.action);
          timed.time_ns = std::max(timed.time_ns, by.time_ns);  // samples may have stopped before
        }
      auto& state = timed.event.state;
      // Told by samples alone: text and record are to name the same instant.
      if (state.shelving != monitoring::Shelving::none && state.shelved_until_ns == 0)
        state.shelved_until_ns =
            timed.time_ns +
            std::llround((static_cast<double>(state.shelved_until) - static_cast<double>(event.sample)) /
                         rate_hz * kNs);
      timed.text = monitoring::alarm_text(timed.event, words_of(index, s, event));
      s.results.events.push_back(std::move(timed));
    }
    s.by.clear();
    if (!s.out.rows.empty() || !s.out.events.empty()) s.changed = true;
    s.out.rows.clear();
    s.out.events.clear();
    s.results.axis = index;
  }

  /// In time; sooner where samples come so fast that the ring, which keeps what follows a snapshot, would
  /// fill.
  static bool snapshot_is_due(const Slot& s, Clock::time_point now) {
    return now >= s.snapshot_due || s.position - s.snapshot_position > s.ring->settings().capacity / 4;
  }

  void make_snapshot(Slot& s, Clock::time_point now) {
    s.snapshot_due = now + seconds(options_.snapshot_every_s);
    s.snapshot_position = s.position;
    if (!s.snapshot_useful) return;
    s.snapshot_useful = false;
    auto bytes = s.monitor.snapshot();
    // A stretch that is being learned from is needed again.
    const auto restored = s.monitor.resume_sample();
    s.results.snapshot = Results::Snapshot{restored, s.ring->position_of(restored), std::move(bytes)};
  }

  /// By whoever has the axis: its worker, or a learner meanwhile.
  void publish(Slot& s, bool with_curve, bool waits_to_learn = false) {
    const auto now = Clock::now();
    s.publish_due = now + seconds(options_.publish_every_s);
    auto live = std::make_shared<LiveAxis>();
    const auto& m = s.monitor;
    live->phase = m.phase();
    live->waits_to_learn = waits_to_learn;
    live->reason = m.reason();
    live->next_sample = m.next_sample();
    live->newest_ns = s.newest_ns;
    live->processed_ns = s.processed_ns;
    live->row_ns = s.row_ns;
    live->row = m.row();
    live->changes = m.facts().changes;
    live->stale = s.silent;
    if (m.alarms().maintenance_until() > m.next_sample())
      live->maintenance_until_ns = m.alarms().maintenance_until_ns();
    for (std::size_t i = 0; i < monitoring::kWatched; ++i)
      live->watches[i] = m.watches(static_cast<monitoring::Watched>(i));
    for (std::size_t i = 0; i < monitoring::kAlarms; ++i)
      live->alarms[i] = m.alarms()[monitoring::AlarmId::of(i)];
    live->detector_interval_s = m.detector_interval_s();
    if (const auto* follower = m.follower()) {
      live->estimate = follower->axis().row();
      live->method = name_of(follower->plan().method);
      live->memory_s = follower->setup().memory_s;
      live->learned_s = static_cast<double>(follower->plan().learned_samples) / m.spec().sample_rate_hz;
      if (follower->plan().start) live->start = follower->plan().start->source;
      if (with_curve && s.changed) {
        s.curve_due = now + seconds(options_.curve_every_s);
        s.curve = std::make_shared<const monitoring::ResponseCurve>(monitoring::response_curve(*follower));
        s.curve_ns = s.row_ns;
        s.changed = false;
      }
    }
    live->curve = s.curve;
    live->curve_ns = s.curve_ns;
    live->revision = revision_.fetch_add(1) + 1;
    s.live.store(std::move(live));
  }

  void hand_over(Worker& worker, Clock::time_point now, bool last) {
    if (!last && now - worker.handed_over < kHandOver) return;
    if (!last && worker.out.load(std::memory_order_acquire) != nullptr) return;  // not yet taken
    auto all = std::make_unique<std::vector<Results>>();
    if (last) {  // nobody waits for a thread that has ended
      const std::unique_ptr<std::vector<Results>> before(worker.out.exchange(nullptr));
      if (before) all->swap(*before);
    }
    for (const std::size_t i : worker.axes) {
      Results& r = slots_[i]->results;
      if (r.rows.empty() && r.events.empty() && r.actions.empty() && !r.snapshot) continue;
      r.axis = i;
      all->push_back(std::move(r));
      r = {};
    }
    worker.handed_over = now;
    if (!all->empty()) worker.out.store(all.release(), std::memory_order_release);
  }

  EngineOptions options_;
  std::vector<std::unique_ptr<Slot>> slots_;
  std::vector<std::unique_ptr<Worker>> workers_;
  std::vector<std::thread> threads_;
  std::atomic<bool> ending_{false}, stopping_{false}, without_store_{false};
  Clock::time_point drain_until_{}, started_{};
  std::atomic<std::uint64_t> revision_{0};
  std::atomic<std::int64_t> busy_ns_{0};
  std::mutex learning_mutex_;
  std::condition_variable learning_;
  std::deque<Slot*> to_learn_;  // by their places
  std::uint64_t places_ = kFirstPlace;
};

Engine::Engine(std::vector<Axis> axes, EngineOptions options)
    : impl_(std::make_unique<Impl>(std::move(axes), std::move(options))) {}
Engine::~Engine() = default;
void Engine::start() { impl_->start(); }
void Engine::stop(double drain_s) { impl_->stop(drain_s); }
std::vector<Results> Engine::take() { return impl_->take(); }
void Engine::stored(std::size_t axis, std::uint64_t position) { impl_->stored(axis, position); }
void Engine::keep_going(bool without_store) { impl_->keep_going(without_store); }
expected<void, Error> Engine::act(std::size_t axis, ActionKind kind, monitoring::AlarmId alarm,
                                  std::optional<double> seconds, std::string who, std::string reason) {
  Told told;
  told.action.kind = kind;
  told.action.alarm = alarm;
  told.time_ns = now_ns();
  told.who = std::move(who);
  told.reason = std::move(reason);
  return impl_->act(axis, std::move(told), seconds);
}
std::shared_ptr<const LiveAxis> Engine::live(std::size_t axis) const { return impl_->live(axis); }
std::size_t Engine::axes() const noexcept { return impl_->axes(); }
std::uint64_t Engine::revision() const noexcept { return impl_->revision(); }
double Engine::busy() const noexcept { return impl_->busy(); }
double Engine::turn_s() const noexcept { return impl_->turn_s(); }

}  // namespace resonid::monitor
