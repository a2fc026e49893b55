// SPDX-License-Identifier: MIT
#pragma once

#include <poll.h>

#include <mutex>
#include <span>
#include <string>
#include <thread>

#include "monitor/sources/delivery.hpp"
#include "monitor/sources/descriptor.hpp"

namespace resonid::monitor {

/// A source that counts with a Delivery, and what state it is in. For any thread.
class CountingSource : public Source {
 public:
  [[nodiscard]] SourceStatus status() const final;

 protected:
  explicit CountingSource(Axes& axes) : delivery_(axes) {}
  void set_state(SourceState state, std::string text = {});

  Delivery delivery_;

 private:
  mutable std::mutex mutex_;
  SourceState state_ = SourceState::starting;
  std::string text_;
};

/// A source with one thread. Whoever derives from it calls stop() in the destructor.
class ThreadSource : public CountingSource {
 public:
  void start() final;
  void stop() final;

 protected:
  using CountingSource::CountingSource;

  /// The thread's body. It ends soon after stopping(), or when nothing more will come.
  virtual void run() = 0;

  [[nodiscard]] bool stopping() const noexcept { return delivery_.stopping(); }
  /// Becomes readable with stop().
  [[nodiscard]] int stop_descriptor() const noexcept { return stop_.get(); }
  /// Until one of `others` is ready or the time is over; false when the source is to stop.
  [[nodiscard]] bool wait(double seconds, std::span<::pollfd> others = {});
  /// Waits while the intake is full: for a source that lets the other side wait. False when it is to stop
  /// instead, and the arrival was not taken.
  [[nodiscard]] bool deliver(const Arrival& arrival, const SourcePosition& position = {});

 private:
  Descriptor stop_;
  std::thread thread_;
  std::mutex ending_;
};

/// Times between attempts: from `first_s` on each is twice the last one, up to `most_s`.
class Backoff {
 public:
  explicit Backoff(double first_s, double most_s = 10.0) noexcept
      : first_s_(first_s), most_s_(most_s), next_s_(first_s) {}
  double next_s() noexcept {
    const double now_s = next_s_;
    next_s_ = 2.0 * next_s_ < most_s_ ? 2.0 * next_s_ : most_s_;
    return now_s;
  }
  void reset() noexcept { next_s_ = first_s_; }

 private:
  double first_s_, most_s_, next_s_;
};

/// What errno means.
[[nodiscard]] std::string system_error_text(int code);

}  // namespace resonid::monitor
