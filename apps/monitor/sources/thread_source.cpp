// SPDX-License-Identifier: MIT
#include "monitor/sources/thread_source.hpp"

#include <fmt/core.h>
#include <sys/eventfd.h>

#include <cerrno>
#include <cmath>
#include <exception>
#include <optional>
#include <system_error>
#include <vector>

namespace resonid::monitor {
namespace {

constexpr double kFullAgain_s = 0.005;  // after which a full intake is tried again

}  // namespace

std::string system_error_text(int code) { return std::generic_category().message(code); }

void ThreadSource::start() {
  stop_ = Descriptor(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (!stop_) {
    set_state(SourceState::failed, fmt::format("no descriptor is left: {}", system_error_text(errno)));
    return;
  }
  try {
    thread_ = std::thread([this] {
      try {
        run();
      } catch (const std::exception& error) {  // memory, above all: the other sources go on
        set_state(SourceState::failed, error.what());
      }
    });
  } catch (const std::system_error& error) {
    set_state(SourceState::failed, fmt::format("no thread can be made: {}", error.what()));
  }
}

void ThreadSource::stop() {
  const std::lock_guard lock(ending_);
  delivery_.stop();
  if (stop_) static_cast<void>(::eventfd_write(stop_.get(), 1));
  if (thread_.joinable()) thread_.join();
}

SourceStatus CountingSource::status() const {
  SourceStatus status = delivery_.status();
  const std::lock_guard lock(mutex_);
  const bool at_work = state_ == SourceState::starting || state_ == SourceState::running;
  if (!at_work || status.state != SourceState::waiting) status.state = state_;
  if (!text_.empty()) status.text = status.text.empty() ? text_ : text_ + "; " + status.text;
  return status;
}

bool ThreadSource::wait(double seconds, std::span<::pollfd> others) {
  std::vector<::pollfd> all(others.begin(), others.end());
  all.push_back({stop_.get(), POLLIN, 0});
  static_cast<void>(::poll(all.data(), all.size(), static_cast<int>(std::ceil(1e3 * seconds))));
  std::copy(all.begin(), all.end() - 1, others.begin());
  return !stopping();
}

bool ThreadSource::deliver(const Arrival& arrival, const SourcePosition& position) {
  std::optional<Delivery::Wait> waiting;
  while (!stopping()) {
    if (delivery_.add(arrival, position) != Intake::Outcome::full) return true;
    if (!waiting) waiting.emplace(delivery_, arrival.axis);
    static_cast<void>(wait(kFullAgain_s));
  }
  return false;
}

void CountingSource::set_state(SourceState state, std::string text) {
  const std::lock_guard lock(mutex_);
  state_ = state;
  text_ = std::move(text);
}

}  // namespace resonid::monitor
