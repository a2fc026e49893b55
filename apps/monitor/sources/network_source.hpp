// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstdint>

#include "monitor/sources/thread_source.hpp"

namespace resonid::monitor {

/// A source that listens.
class NetworkSource : public ThreadSource {
 public:
  /// The port; 0 while there is none.
  [[nodiscard]] std::uint16_t bound_port() const noexcept { return port_.load(std::memory_order_acquire); }

 protected:
  using ThreadSource::ThreadSource;
  std::atomic<std::uint16_t> port_{0};
};

}  // namespace resonid::monitor
