// SPDX-License-Identifier: MIT
#include "monitor/service/service.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <resonid/base/error_text.hpp>
#include <system_error>
#include <utility>

#include "monitor/service/live_backend.hpp"
#include "monitor/service/log.hpp"
#include "monitor/service/recorder.hpp"
#include "monitor/service/watch.hpp"
#include "monitor/store/reader.hpp"
#include "monitor/web/server.hpp"

namespace resonid::monitor {
namespace {

using Json = nlohmann::json;
constexpr std::size_t kMostReplayedActions = 100'000;
constexpr std::size_t kMostKnownAlarms = 100'000;
constexpr double kMeanwhile_s = 15.0;  // until a snapshot is stored

Error store_error(const StoreError& error) { return Error{"data", error.text}; }

/// The axes of one source, by what it calls them.
class SourceAxes : public Axes {
 public:
  void add(const std::string& channel, Intake* intake) {
    by_name_[channel] = intake;
    all_.push_back(intake);
  }
  Intake* find(std::string_view name) override {
    const auto found = by_name_.find(name);
    if (found != by_name_.end()) return found->second;
    return name.empty() && all_.size() == 1 ? all_.front() : nullptr;
  }
  std::span<Intake* const> all() override { return all_; }

 private:
  std::map<std::string, Intake*, std::less<>> by_name_;
  std::vector<Intake*> all_;
};

std::vector<Told> told_of(const std::vector<ActionRecord>& records) {
  std::vector<Told> all;
  for (const auto& r : records) {
    const auto kind = from_name<monitoring::ActionKind>(r.kind);
    const Json json = Json::parse(r.arguments, nullptr, false);
    if (!kind || !json.is_object()) continue;
    Told told;
    told.action.sample = r.sample;
    told.action.kind = *kind;
    told.action.id = json.value("id", std::uint64_t{0});
    told.action.until_sample = json.value("until_sample", std::uint64_t{0});
    told.action.until_ns = json.value("until_ns", std::int64_t{0});
    told.action.alarm = monitoring::AlarmId::of(
        std::min<std::size_t>(json.value("alarm", std::size_t{0}), monitoring::kAlarms - 1));
    told.time_ns = r.time_ns;
    told.who = r.who;
    told.reason = r.reason;
    all.push_back(std::move(told));
  }
  return all;
}

/// Samples: what is configured, or what learning may need, beside what comes meanwhile.
expected<std::uint64_t, Error> capacity_of(const InstalledAxis& axis) {
  auto monitor = monitoring::AxisMonitor::create(axis.spec);
  if (!monitor) {
    monitor.error().where = "axis " + axis.spec.name;
    return tl::unexpected(std::move(monitor.error()));
  }
  const double rate_hz = axis.spec.sample_rate_hz;
  const auto samples = [rate_hz](double s) { return static_cast<std::uint64_t>(std::ceil(s * rate_hz)); };
  return std::max(
      {std::uint64_t{1024}, samples(axis.ring_s), 2 * monitor->longest_stretch() + samples(kMeanwhile_s)});
}

/// Events of the next sample come again only with an action that the snapshot has not seen.
std::uint64_t replayed_from(const Engine::Axis& axis) {
  const std::uint64_t next = axis.monitor.next_sample();
  const bool again = std::any_of(axis.actions.begin(), axis.actions.end(), [&](const Told& told) {
    return told.action.sample == next && told.action.id > axis.monitor.last_action();
  });
  return again ? next : next + 1;
}

}  // namespace

struct Service::Parts {
  Installation installation;
  std::vector<std::unique_ptr<Ring>> rings;
  std::vector<std::unique_ptr<Intake>> intakes;
  std::vector<std::string> hashes;
  std::map<std::string, SourceAxes> source_axes;
  std::unique_ptr<Engine> engine;
  std::unique_ptr<Recorder> recorder;
  std::vector<std::unique_ptr<Source>> sources;
  std::unique_ptr<LiveBackend> backend;
  std::unique_ptr<web::WebServer> server;
  struct Beginning {
    std::string anew;                 // why; empty: it goes on
    std::uint64_t replayed_from = 0;  // events from here on
  };
  std::vector<Beginning> beginnings;  // [axis]
  Watch watch;
  bool stopped = false;

  std::optional<Error> open_rings() {
    for (const auto& axis : installation.axes) {
      RingSettings settings;
      settings.axis = axis.spec.name;
      settings.channels = ring_channels(axis.columns);
      settings.sample_rate_hz = axis.spec.sample_rate_hz;
      const auto capacity = capacity_of(axis);
      if (!capacity) return capacity.error();
      settings.capacity = *capacity;
      bool renewed = false;
      auto ring =
          Ring::open_or_renew(installation.data / "rings" / (axis.spec.name + ".ring"), settings, renewed);
      if (!ring) return std::move(ring.error());
      if (const std::string& damage = (*ring)->set_aside(); !damage.empty())
        say(LogLevel::warning, "axis {}: {}, and a new one is made", axis.spec.name, damage);
      if (renewed)
        say(LogLevel::warning,
            "axis {}: its ring of raw samples is made anew, for another rate, other columns or another "
            "length",
            axis.spec.name);
      rings.push_back(std::move(*ring));
      intakes.push_back(std::make_unique<Intake>(*rings.back(), axis.columns));
      source_axes[axis.source].add(axis.channel.empty() ? axis.spec.name : axis.channel,
                                   intakes.back().get());
    }
    return std::nullopt;
  }

  /// A ring that was removed, or that a power cut threw back, goes on where the store knows it to have been:
  /// what it lacks is a gap.
  std::optional<Error> catch_up(Reader& reader, std::size_t i, std::uint64_t snapshot_sample) {
    const auto stored = reader.position(installation.axes[i].spec.name);
    if (!stored) return store_error(stored.error());
    Ring& ring = *rings[i];
    PositionRecord at{{}, snapshot_sample, ring.sender_offset(), ring.source().word};
    if (*stored && (*stored)->next_sample >= snapshot_sample) at = **stored;
    if (ring.next_sample() >= at.next_sample) return std::nullopt;
    say(LogLevel::warning, "axis {}: its ring of raw samples lacks the samples {} to {}, which are a gap",
        installation.axes[i].spec.name, ring.next_sample(), at.next_sample);
    ring.put_anchor(at.next_sample, std::nullopt);
    ring.commit({at.word}, at.sender_offset);
    return std::nullopt;
  }

  void begin_anew(std::size_t i, std::string why) {
    say(LogLevel::warning, "axis {} begins anew: {}", installation.axes[i].spec.name, why);
    beginnings[i].anew = std::move(why);
  }

  /// The axis as a former process left it, else anew.
  expected<Engine::Axis, Error> restored(Reader& reader, std::size_t i) {
    const auto& axis = installation.axes[i];
    auto stored = reader.snapshot(axis.spec.name);
    if (!stored) return tl::unexpected(store_error(stored.error()));
    if (*stored) {
      const auto& s = (*stored)->snapshot;
      if (auto fault = catch_up(reader, i, s.sample)) return tl::unexpected(std::move(*fault));
      // Compared first: with another one the snapshot may not fit.
      const bool same = s.configuration_hash == hashes[i];
      auto monitor = monitoring::AxisMonitor::restore(axis.spec, s.bytes);
      if (!same)
        begin_anew(i, "its configuration has changed");
      else if (!monitor)
        begin_anew(i, fmt::format("its snapshot {}", monitor.error().requirement.view()));
      else {
        auto actions = reader.actions(axis.spec.name, monitor->next_sample(), kMostReplayedActions);
        if (!actions) return tl::unexpected(store_error(actions.error()));
        Engine::Axis goes_on{std::move(*monitor), rings[i].get(), told_of(*actions)};
        std::erase_if(goes_on.actions, [&](const Told& told) {
          return told.action.id <=
                 goes_on.monitor.last_action();  // it knows them, or they are a former axis'
        });
        beginnings[i].replayed_from = replayed_from(goes_on);
        return goes_on;
      }
    }
    auto monitor = monitoring::AxisMonitor::create(axis.spec);
    if (!monitor) {
      Error e = std::move(monitor.error());
      e.where = "axis " + axis.spec.name;
      return tl::unexpected(std::move(e));
    }
    Engine::Axis begun{std::move(*monitor), rings[i].get(), {}, true};
    if (*stored) {
      // It takes in what the ring still has: what was done to the former axis meanwhile is not done again.
      const auto newest = reader.newest_action(axis.spec.name);
      if (!newest) return tl::unexpected(store_error(newest.error()));
      if (*newest)
        for (const auto& told : told_of({**newest})) begun.monitor.count_actions_after(told.action.id);
    }
    return begun;
  }

  std::optional<Error> open() {
    std::error_code code;
    for (const char* folder : {"rings", "evidence"}) {
      std::filesystem::create_directories(installation.data / folder, code);
      if (code)
        return Error{"data", fmt::format("the folder '{}' cannot be made: {}",
                                         (installation.data / folder).string(), code.message())};
    }
    StoreOptions options;
    options.program_version = installation.version;
    options.retention = installation.retention;
    const std::string file = (installation.data / "monitor.sqlite").string();
    auto store = Store::open(file, options);
    if (!store) return store_error(store.error());
    if (auto fault = open_rings()) return fault;
    auto reader = Reader::open(file);
    if (!reader) return store_error(reader.error());
    std::vector<Engine::Axis> axes;
    beginnings.resize(installation.axes.size());
    for (std::size_t i = 0; i < installation.axes.size(); ++i) {
      hashes.push_back(configuration_hash(installation.axes[i].configuration));
      auto axis = restored(*reader, i);
      if (!axis) return std::move(axis.error());
      axes.push_back(std::move(*axis));
    }
    EngineOptions options_of_engine = installation.engine;
    options_of_engine.refused = [this](std::size_t i) { return !intakes[i]->refusal().empty(); };
    engine = std::make_unique<Engine>(std::move(axes), std::move(options_of_engine));
    auto known = reader->alarms(AlarmFilter::open, std::nullopt, kMostKnownAlarms);
    if (!known) return store_error(known.error());
    auto recorders_reader = Reader::open(file);
    if (!recorders_reader) return store_error(recorders_reader.error());
    auto deliveries = Deliveries::open(*reader, installation.targets, {});
    if (!deliveries) return store_error(deliveries.error());
    std::vector<Recorder::Axis> recorded;
    std::vector<LiveBackend::Axis> live;
    for (std::size_t i = 0; i < rings.size(); ++i) {
      recorded.push_back({&installation.axes[i], rings[i].get(), intakes[i].get(), hashes[i],
                          beginnings[i].anew, beginnings[i].replayed_from});
      live.push_back({&installation.axes[i], rings[i].get(), intakes[i].get(), hashes[i]});
    }
    recorder = std::make_unique<Recorder>(std::move(*store), std::move(*recorders_reader), *engine,
                                          std::move(recorded), installation, *known, std::move(*deliveries),
                                          [this](const AlarmRecord& r) {
                                            if (server) server->alarm(alarm_of(r));
                                          });
    std::vector<LiveBackend::RunningSource> running;
    for (const auto& source : installation.sources) {
      auto made = source.make(source_axes[source.name]);
      if (!made) {
        Error e = std::move(made.error());
        e.where = "source " + source.name;
        return e;
      }
      sources.push_back(std::move(*made));
      running.push_back({&source, sources.back().get()});
    }
    backend = std::make_unique<LiveBackend>(installation, *engine, *recorder, std::move(*reader),
                                            std::move(live), std::move(running));
    auto web = web::WebServer::start(*backend, installation.web);
    if (!web) return std::move(web.error());
    server = std::move(*web);
    recorder->start();
    engine->start();
    for (auto& source : sources) source->start();
    for (std::size_t i = 0; i < sources.size(); ++i) watch.add(installation.sources[i].name, *sources[i]);
    for (std::size_t i = 0; i < intakes.size(); ++i) watch.add(installation.axes[i].spec.name, *intakes[i]);
    watch.start();
    say(LogLevel::info, "version {} runs: {} axes, {} sources, page at {}, data in '{}'",
        installation.version, rings.size(), sources.size(), server->url(), installation.data.string());
    return std::nullopt;
  }

  [[nodiscard]] bool finished() const {
    const auto ended = [](const auto& source) {
      const auto state = source->status().state;
      return state == SourceState::ended || state == SourceState::failed;
    };
    if (!std::all_of(sources.begin(), sources.end(), ended)) return false;
    for (std::size_t i = 0; i < rings.size(); ++i) {
      const auto live = engine->live(i);
      if (live->phase == monitoring::Phase::learning || live->next_sample < rings[i]->next_sample())
        return false;
    }
    return true;
  }

  void stop() {
    watch.stop();
    for (auto& source : sources) source->stop();
    if (engine) engine->stop();
    if (recorder) recorder->stop();
    if (server) server->stop();
    if (!std::exchange(stopped, true) && server) say(LogLevel::info, "stopped");
  }
};

Service::Service(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
Service::~Service() { stop(); }

expected<std::unique_ptr<Service>, Error> Service::start(Installation installation) {
  auto parts = std::make_unique<Parts>();
  parts->installation = std::move(installation);
  std::unique_ptr<Service> service(new Service(std::move(parts)));
  if (auto fault = service->parts_->open()) return tl::unexpected(std::move(*fault));
  return service;
}

void Service::stop() { parts_->stop(); }
bool Service::finished() const { return parts_->finished(); }
std::string Service::url() const { return parts_->server->url(); }
bool Service::healthy() const { return parts_->backend->readiness().engine; }
const web::Backend& Service::backend() const { return *parts_->backend; }
web::Backend& Service::backend() { return *parts_->backend; }

}  // namespace resonid::monitor
