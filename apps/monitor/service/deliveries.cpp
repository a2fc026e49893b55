// SPDX-License-Identifier: MIT
#include "monitor/service/deliveries.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <iterator>
#include <mutex>
#include <string_view>
#include <thread>

#include "monitor/service/alarm_view.hpp"
#include "monitor/service/log.hpp"
#include "monitor/web/api_json.hpp"

namespace resonid::monitor {
namespace {

std::int64_t ns_of_wait(double seconds) { return static_cast<std::int64_t>(seconds * 1e9); }

/// Without the address: it may be a secret.
std::string words_of_fault(const Error& error) {
  if (error.field.view() == "publisher") return error.requirement.str();
  return fmt::format("{}: {}", error.field.view(), error.requirement.view());
}

}  // namespace

/// What waits for one target. In the store its key begins with the target's name; the other side sees the
/// rest, which is the same for all.
struct Deliveries::Line {
  InstalledTarget target;
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<OutboxRecord> waiting;  // the first one is being sent
  std::vector<DeliveryRecord> told;
  Status status;
  std::unique_ptr<Publisher> publisher;
  bool stopping = false, ended = false;
  std::thread thread;

  [[nodiscard]] std::string key_of(std::string_view stored) const {
    return std::string(stored.substr(target.name.size() + 1));
  }
  void give_up(std::size_t index, std::string why) {
    told.push_back({waiting[index].key, now_ns(), std::nullopt, "given up: " + std::move(why)});
    waiting.erase(waiting.begin() + static_cast<std::ptrdiff_t>(index));
    ++status.given_up;
    say(LogLevel::error, "{}: message '{}' is {}", target.name, told.back().key, told.back().text);
  }
  void add(OutboxRecord message, std::size_t most) {
    waiting.push_back(std::move(message));
    if (waiting.size() > most && waiting.size() > 2) give_up(1, "too many messages wait");
  }
  /// Without the lock.
  expected<void, Error> deliver(const OutboxRecord& message) {
    if (!publisher) {
      auto made = target.make();
      if (!made) return tl::unexpected(std::move(made.error()));
      const std::scoped_lock lock(mutex);
      publisher = std::move(*made);
    }
    return publisher->publish(key_of(message.key), target.topic, message.payload);
  }
};

Deliveries::Deliveries(std::string installation, const Options& options)
    : installation_(std::move(installation)), options_(options) {}

Deliveries::~Deliveries() { stop(); }

expected<std::unique_ptr<Deliveries>, StoreError> Deliveries::open(Reader& reader,
                                                                   std::vector<InstalledTarget> targets,
                                                                   const Options& options) {
  auto installation = reader.installation();
  if (!installation) return tl::unexpected(std::move(installation.error()));
  auto waiting = reader.outbox_targets();
  if (!waiting) return tl::unexpected(std::move(waiting.error()));
  std::unique_ptr<Deliveries> all(new Deliveries(std::move(*installation), options));
  for (auto& target : targets) {
    all->lines_.push_back(std::make_unique<Line>());
    all->lines_.back()->status.name = target.name;
    all->lines_.back()->target = std::move(target);
  }
  for (auto& name : *waiting) {
    const auto line = std::find_if(all->lines_.begin(), all->lines_.end(),
                                   [&](const auto& one) { return one->target.name == name; });
    if (line == all->lines_.end()) {
      all->forgotten_.push_back(
          {std::move(name), now_ns(), std::nullopt, "given up: the target is no longer configured", true});
      continue;
    }
    // All: what is too much is given up, and nothing waits for the next start.
    auto messages = reader.outbox_due(std::numeric_limits<std::int64_t>::max(),
                                      std::numeric_limits<std::size_t>::max(), name);
    if (!messages) return tl::unexpected(std::move(messages.error()));
    for (auto& stored : *messages) {
      if (!stored.text.empty()) (*line)->status.fault = stored.text;  // of those that were tried
      (*line)->add(std::move(stored.message), options.most_waiting);
    }
  }
  return all;
}

void Deliveries::start() {
  for (auto& line : lines_) line->thread = std::thread([this, &l = *line] { run(l); });
}

void Deliveries::stop() {
  constexpr auto kAgain = std::chrono::milliseconds(20);
  for (auto& line : lines_) {
    const std::scoped_lock lock(line->mutex);
    line->stopping = true;
    line->changed.notify_all();
  }
  for (auto& line : lines_) {
    if (!line->thread.joinable()) continue;
    std::unique_lock lock(line->mutex);
    while (!line->ended) {  // told again: it may have begun to send only now
      if (line->publisher) line->publisher->interrupt();
      line->changed.wait_for(lock, kAgain, [&] { return line->ended; });
    }
    lock.unlock();
    line->thread.join();
    line->publisher.reset();
  }
}

void Deliveries::run(Line& line) {
  double wait_s = options_.first_wait_s;
  std::unique_lock lock(line.mutex);
  while (true) {
    line.changed.wait(lock, [&] { return line.stopping || !line.waiting.empty(); });
    if (line.stopping) break;
    const OutboxRecord message = line.waiting.front();
    lock.unlock();
    const auto done = line.deliver(message);
    lock.lock();
    const std::int64_t now = now_ns();
    if (done) {
      line.told.push_back({message.key, now, std::nullopt, {}});
      if (!line.status.fault.empty()) say(LogLevel::info, "{}: alarms are taken again", line.target.name);
      line.waiting.pop_front();
      line.status.fault.clear();
      ++line.status.delivered;
      wait_s = options_.first_wait_s;
      continue;
    }
    if (line.stopping) break;
    ++line.status.failures;
    const std::string fault = words_of_fault(done.error());
    say(fault == line.status.fault ? LogLevel::debug : LogLevel::warning,
        "{}: alarms are not taken, {} wait: {}", line.target.name, line.waiting.size(), fault);
    line.status.fault = fault;
    // What is refused for what it is must not keep the others for ever.
    const bool refused = done.error().field.view() != "publisher" && line.publisher;
    if (now - message.created_ns > ns_of_wait(refused ? options_.refused_s : options_.patience_s))
      line.give_up(0, line.status.fault);
    else
      line.told.push_back({message.key, now, now + ns_of_wait(wait_s), line.status.fault});
    line.changed.wait_for(lock, std::chrono::duration<double>(wait_s), [&] { return line.stopping; });
    wait_s = std::min(2.0 * wait_s, options_.most_wait_s);
  }
  line.ended = true;
  line.changed.notify_all();
}

void Deliveries::queue(const AlarmRecord& alarm, const EventRecord& event, std::int64_t time_ns,
                       Batch& batch) const {
  if (lines_.empty()) return;
  const std::string body = web::notice_json(alarm_of(alarm), event_of(event));
  std::string key = fmt::format("{}:{}:{}:{}", installation_, event.alarm_id, event.sample, event.transition);
  if (event.action != 0) key += fmt::format(":{}", event.action);
  for (const auto& line : lines_)
    batch.outbox.push_back({line->target.name + "/" + key, line->target.name, body, time_ns});
}

void Deliveries::send(std::vector<OutboxRecord> messages) {
  for (auto& message : messages)
    for (auto& line : lines_) {
      if (line->target.name != message.target) continue;
      const std::scoped_lock lock(line->mutex);
      line->add(std::move(message), options_.most_waiting);
      line->changed.notify_all();
      break;
    }
}

std::vector<DeliveryRecord> Deliveries::take() {
  auto all = std::exchange(forgotten_, {});
  for (auto& line : lines_) {
    const std::scoped_lock lock(line->mutex);
    std::move(line->told.begin(), line->told.end(), std::back_inserter(all));
    line->told.clear();
  }
  return all;
}

std::vector<Deliveries::Status> Deliveries::status() const {
  std::vector<Status> all;
  for (const auto& line : lines_) {
    const std::scoped_lock lock(line->mutex);
    all.push_back(line->status);
    all.back().waiting = line->waiting.size();
  }
  return all;
}

}  // namespace resonid::monitor
