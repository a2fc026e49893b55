// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

namespace resonid::cli {

/// Tells on standard error what is being worked at and how long it has taken: in one line that is renewed,
/// when that is a screen and the work lasts longer than a second; with -v every stage in a line of its own.
/// With -q nothing.
class Progress {
 public:
  Progress();
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void stage(std::string_view name);

  /// Ends the line on the screen; before anything else is printed.
  void finish();

 private:
  void watch();
  [[nodiscard]] double elapsed_s() const;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::mutex mutex_;
  std::condition_variable changed_;
  std::string stage_;
  bool done_ = false;
  std::thread watcher_;
};

/// finish() of the one that is there, if any.
void finish_progress();

}  // namespace resonid::cli
