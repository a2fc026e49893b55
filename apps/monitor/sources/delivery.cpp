// SPDX-License-Identifier: MIT
#include "monitor/sources/delivery.hpp"

#include <fmt/core.h>

#include <algorithm>

namespace resonid::monitor {

Intake* Delivery::find(std::string_view axis) const {
  if (!axis.empty()) return axes_.find(axis);
  const auto all = axes_.all();
  return all.size() == 1 ? all.front() : nullptr;
}

Intake::Outcome Delivery::add(const Arrival& arrival, const SourcePosition& position) {
  Intake* const intake = find(arrival.axis);
  if (intake == nullptr) {
    count_message();
    count_unknown(arrival.axis.empty() ? std::string("samples without an axis; its name is required")
                                       : fmt::format("samples of '{}'; a configured axis is required",
                                                     printable(arrival.axis)));
    return Intake::Outcome::refused;
  }
  const auto outcome = intake->add(arrival, position);
  if (outcome != Intake::Outcome::full) count_message();
  return outcome;
}

void Delivery::drop(const Arrival& arrival) {
  count_message();
  count_lost(1);
  if (Intake* const intake = find(arrival.axis)) intake->lost(arrival.samples());
}

Delivery::Wait::Wait(Delivery& delivery, std::string_view name) : delivery_(delivery) {
  const std::lock_guard lock(delivery.mutex_);
  ++delivery.waits_;
  delivery.waits_for_ = name.empty() ? std::string("for room in the ring")
                                     : fmt::format("for room in the ring of '{}'", printable(name));
}

Delivery::Wait::~Wait() {
  const std::lock_guard lock(delivery_.mutex_);
  --delivery_.waits_;
}

void Delivery::count_unknown(std::string what) {
  unknown_.fetch_add(1, std::memory_order_relaxed);
  {
    const std::lock_guard lock(mutex_);
    if (first_unknown_.size() < kMostFirstUnknown &&
        std::find(first_unknown_.begin(), first_unknown_.end(), what) == first_unknown_.end())
      first_unknown_.push_back(what);
  }
  faults_.note(Fault::axis, std::move(what));
}

FaultLog& Delivery::faults() const {
  const auto all = axes_.all();
  return all.size() == 1 ? all.front()->faults() : faults_;
}

SourceStatus Delivery::status() const {
  SourceStatus status;
  status.state = SourceState::running;
  {
    const std::lock_guard lock(mutex_);
    if (waits_ > 0) {
      status.state = SourceState::waiting;
      status.text = waits_for_;
    }
    status.first_unknown = first_unknown_;
  }
  status.messages = messages_.load(std::memory_order_relaxed);
  status.bytes = bytes_.load(std::memory_order_relaxed);
  status.lost = lost_.load(std::memory_order_relaxed);
  status.unknown = unknown_.load(std::memory_order_relaxed);
  for (const auto& [kind, name] : kFaultNames)
    status.faults[static_cast<std::size_t>(kind)] = faults_.count(kind);
  const auto tell = [&](const FaultLog& log) {
    for (const auto& [kind, name] : kFaultNames)
      if (log.count(kind) > 0)
        status.text += fmt::format("{}{} ({}): {}", status.text.empty() ? "" : "; ", name, log.count(kind),
                                   log.example(kind));
  };
  tell(faults_);
  if (const FaultLog& only = faults(); &only != &faults_) tell(only);
  return status;
}

}  // namespace resonid::monitor
