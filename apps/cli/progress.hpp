// SPDX-License-Identifier: MIT
#pragma once

#include <condition_variable>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

namespace resonid::cli {

/// Tells on standard error what is being worked at, when that is a terminal and the work lasts longer than a
/// second.
class Progress {
 public:
  Progress();
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void stage(std::string_view name);

 private:
  void watch();
  std::mutex mutex_;
  std::condition_variable changed_;
  std::string stage_;
  std::string shown_;
  bool done_ = false;
  std::thread watcher_;
};

}  // namespace resonid::cli
