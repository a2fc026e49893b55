// SPDX-License-Identifier: MIT
#include "monitor/service/log.hpp"

#include <fmt/chrono.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <ctime>

#include "monitor/engine/engine.hpp"
#include "monitor/samples/faults.hpp"

namespace resonid::monitor {
namespace {

constexpr std::size_t kMostBytes = 4000;
constexpr std::array kPriorities = {3, 4, 6, 7};  // of syslog, by level

std::atomic<LogLevel> current_level{LogLevel::error};

}  // namespace

void set_log_level(LogLevel level) noexcept { current_level.store(level, std::memory_order_relaxed); }
LogLevel log_level() noexcept { return current_level.load(std::memory_order_relaxed); }

std::string log_line(LogLevel level, std::string_view text, std::int64_t time_ns, bool journal) {
  constexpr std::int64_t kMillisecond_ns = 1'000'000, kMilliseconds = 1000;
  const std::string words = printable(text, kMostBytes);
  if (journal) return fmt::format("<{}>{}\n", kPriorities[static_cast<std::size_t>(level)], words);
  const std::int64_t ms = time_ns / kMillisecond_ns;
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z {} {}\n",
                     fmt::gmtime(static_cast<std::time_t>(ms / kMilliseconds)), ms % kMilliseconds,
                     name_of(level), words);
}

bool logs_to_journal() {
  const char* stream = std::getenv("JOURNAL_STREAM");
  struct ::stat status {};
  return stream != nullptr && ::fstat(STDERR_FILENO, &status) == 0 &&
         fmt::format("{}:{}", status.st_dev, status.st_ino) == stream;
}

void write_log(LogLevel level, std::string_view text) noexcept {
  try {
    static const bool journal = logs_to_journal();
    const std::string line = log_line(level, text, now_ns(), journal);
    static_cast<void>(!::write(STDERR_FILENO, line.data(), line.size()));
  } catch (...) {  // without memory the line is lost, not the service
  }
}

}  // namespace resonid::monitor
