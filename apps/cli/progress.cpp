// SPDX-License-Identifier: MIT
#include "progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include "output.hpp"
#include "terminal.hpp"

namespace resonid::cli {
namespace {

constexpr std::chrono::milliseconds kPatience{1000}, kRenewal{200};

/// One line of the screen: what is longer would not be cleared.
std::string fitting(std::string line) {
  const std::size_t width = text_width() - 1;
  while (columns_of(line) > width) line.pop_back();
  return line;
}

bool is_verbose() { return output_settings().verbose && !output_settings().quiet; }

/// Verbs have one at a time; print() ends its line.
Progress*& present() {
  static Progress* progress = nullptr;
  return progress;
}

}  // namespace

void finish_progress() {
  if (present() != nullptr) present()->finish();
}

Progress::Progress() {
  present() = this;
  if (is_screen(STDERR_FILENO) && !output_settings().quiet && !is_verbose())
    watcher_ = std::thread([this] { watch(); });
}

Progress::~Progress() {
  finish();
  present() = nullptr;
  if (is_verbose()) print_error(fmt::format("resonid: {:7.2f} s  end\n", elapsed_s()));
}

void Progress::finish() {
  {
    const std::lock_guard lock(mutex_);
    done_ = true;
  }
  changed_.notify_all();
  if (watcher_.joinable()) watcher_.join();
}

double Progress::elapsed_s() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
}

void Progress::stage(std::string_view name) {
  const std::lock_guard lock(mutex_);
  stage_ = name;
  if (is_verbose()) print_error(fmt::format("resonid: {:7.2f} s  {}\n", elapsed_s(), name));
}

void Progress::watch() {
  std::unique_lock lock(mutex_);
  if (changed_.wait_for(lock, kPatience, [this] { return done_; })) return;
  while (!done_) {
    print_error("\r" + fitting(fmt::format("resonid: {:.1f} s, {}", elapsed_s(), stage_)) + "\x1b[K");
    changed_.wait_for(lock, kRenewal, [this] { return done_; });
  }
  print_error("\r\x1b[K");
}

}  // namespace resonid::cli
