// SPDX-License-Identifier: MIT
#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "monitor/samples/intake.hpp"
#include "monitor/sources/source.hpp"

namespace resonid::monitor {

/// Says in the log what becomes of sources, which axes they bring that nobody configured, and, at most once a
/// minute for each axis, what its samples lack. Looks once a second, on a thread of its own.
class Watch {
 public:
  Watch() = default;
  ~Watch() { stop(); }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  /// Before start(). Both outlive this or stop().
  void add(std::string name, const Source& source) {
    sources_.push_back({std::move(name), &source, {}, {}, 0});
  }
  void add(std::string name, const Intake& intake) { axes_.push_back({std::move(name), &intake, {}, 0}); }
  void start();
  void stop();
  /// One look. `second`: counts looks.
  void look(std::uint64_t second);

 private:
  struct Counts {
    std::uint64_t missing = 0, late = 0, duplicate = 0, lost = 0, faults = 0;
    bool operator==(const Counts&) const = default;
  };
  struct WatchedSource {
    std::string name;
    const Source* source;
    SourceState state;
    std::string text;
    std::size_t unknown_told;  // of those that are told one by one
  };
  struct WatchedAxis {
    std::string name;
    const Intake* intake;
    Counts told;
    std::uint64_t next = 0;  // second from which on it may be said again
  };
  void look(WatchedSource& one);
  [[nodiscard]] bool look(WatchedAxis& one, std::uint64_t second);

  std::vector<WatchedSource> sources_;
  std::vector<WatchedAxis> axes_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace resonid::monitor
