// SPDX-License-Identifier: MIT
#include "monitor/brokers/broker_source.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>

namespace resonid::monitor {
namespace {

constexpr double kFirstAttempt_s = 0.25, kMostAttempt_s = 10.0;

}  // namespace

void BrokerSource::start() {
  thread_ = std::thread([this] { loop(); });
}

void BrokerSource::stop() {
  const std::lock_guard ending(ending_);
  {
    const std::lock_guard lock(mutex_);
    feed_.stop();
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void BrokerSource::loop() {
  double wait_s = kFirstAttempt_s;
  while (!stopping()) {
    set(SourceState::starting);
    std::string why = run();
    if (stopping()) return;
    {
      const std::lock_guard lock(mutex_);
      if (state_ == SourceState::running) wait_s = kFirstAttempt_s;
    }
    set(SourceState::waiting, std::move(why));
    wait(wait_s);
    wait_s = std::min(2.0 * wait_s, kMostAttempt_s);
  }
}

void BrokerSource::wait(double seconds) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, std::chrono::duration<double>(seconds), [this] { return stopping(); });
}

void BrokerSource::set(SourceState state, std::string text) {
  const std::lock_guard lock(mutex_);
  state_ = state;
  text_ = std::move(text);
}

SourceStatus BrokerSource::status() const {
  SourceStatus status = feed_.status();
  const std::lock_guard lock(mutex_);
  status.state = state_;
  if (!text_.empty()) status.text = status.text.empty() ? text_ : fmt::format("{}; {}", text_, status.text);
  return status;
}

}  // namespace resonid::monitor
