// SPDX-License-Identifier: MIT
#include "monitor/service/watch.hpp"

#include <chrono>

#include "monitor/service/log.hpp"

namespace resonid::monitor {
namespace {

constexpr std::uint64_t kAgain_s = 60;
constexpr int kMostLines = 20;  // of axes, in one look

LogLevel level_of(SourceState state) {
  if (state == SourceState::failed) return LogLevel::error;
  return state == SourceState::waiting ? LogLevel::warning : LogLevel::info;
}

}  // namespace

void Watch::start() {
  thread_ = std::thread([this] {
    std::unique_lock lock(mutex_);
    for (std::uint64_t second = 0; !stopping_; ++second) {
      look(second);
      changed_.wait_for(lock, std::chrono::seconds(1), [this] { return stopping_; });
    }
  });
}

void Watch::stop() {
  {
    const std::scoped_lock lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void Watch::look(std::uint64_t second) {
  for (auto& one : sources_) look(one);
  int lines = 0;
  for (auto& one : axes_)  // the others have their turn in the next look
    if (look(one, second) && ++lines == kMostLines) break;
}

void Watch::look(WatchedSource& one) {
  const auto now = one.source->status();
  for (; one.unknown_told < now.first_unknown.size(); ++one.unknown_told)
    say(LogLevel::warning, "source {}: {}{}", one.name, now.first_unknown[one.unknown_told],
        one.unknown_told + 1 == kMostFirstUnknown ? "; further ones are only counted" : "");
  const bool why = now.state == SourceState::waiting || now.state == SourceState::failed;
  if (now.state == one.state && (!why || now.text == one.text)) return;
  one.state = now.state;
  one.text = now.text;
  say(level_of(now.state), "source {} is {}{}{}", one.name, name_of(now.state), now.text.empty() ? "" : ": ",
      now.text);
}

bool Watch::look(WatchedAxis& one, std::uint64_t second) {
  if (second < one.next) return false;
  const auto& c = one.intake->counters();
  const auto& faults = one.intake->faults();
  const Counts now{c.missing, c.late, c.duplicate, c.lost, faults.total()};
  if (now == one.told) return false;
  std::string example;
  for (const auto& fault : kFaultNames)
    if (faults.count(fault.value) > 0) example = faults.example(fault.value);
  say(LogLevel::warning,
      "axis {}: {} samples missing, {} late, {} double, {} lost, {} faults{}{} (since the last line; "
      "{} missing in all)",
      one.name, now.missing - one.told.missing, now.late - one.told.late, now.duplicate - one.told.duplicate,
      now.lost - one.told.lost, now.faults - one.told.faults, now.faults > one.told.faults ? ": " : "",
      now.faults > one.told.faults ? example : "", now.missing);
  one.told = now;
  one.next = second + kAgain_s;
  return true;
}

}  // namespace resonid::monitor
