// SPDX-License-Identifier: MIT
#include "progress.hpp"

#include <unistd.h>

#include <chrono>

#include "output.hpp"

namespace resonid::cli {

Progress::Progress() {
  if (isatty(STDERR_FILENO) != 0) watcher_ = std::thread([this] { watch(); });
}

Progress::~Progress() {
  {
    const std::lock_guard lock(mutex_);
    done_ = true;
  }
  changed_.notify_all();
  if (watcher_.joinable()) watcher_.join();
}

void Progress::stage(std::string_view name) {
  {
    const std::lock_guard lock(mutex_);
    stage_ = name;
  }
  changed_.notify_all();
}

void Progress::watch() {
  std::unique_lock lock(mutex_);
  if (changed_.wait_for(lock, std::chrono::seconds(1), [this] { return done_; })) return;
  while (!done_) {
    if (stage_ != shown_) {
      shown_ = stage_;
      print_error("resonid: " + shown_ + " ...\n");
    }
    changed_.wait(lock, [this] { return done_ || stage_ != shown_; });
  }
}

}  // namespace resonid::cli
