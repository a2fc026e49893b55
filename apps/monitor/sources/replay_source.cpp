// SPDX-License-Identifier: MIT
#include "monitor/sources/replay_source.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string_view>
#include <utility>
#include <vector>

#include "monitor/sources/thread_source.hpp"

namespace resonid::monitor {
namespace {

constexpr std::size_t kReplayed = 256;   // samples of an arrival: a quarter of the smallest ring
constexpr double kReplayPiece_s = 0.02;  // between looks at the clock

class ReplaySource final : public ThreadSource {
 public:
  ReplaySource(ReplaySettings settings, Axes& axes) : ThreadSource(axes), settings_(std::move(settings)) {
    const auto& r = *settings_.record;
    const std::pair<std::string_view, const data::Channel*> channels[] = {
        {"ru", &r.excitation}, {"u", &r.input}, {"y", &r.output}, {"position", &r.position}};
    for (const auto& [name, channel] : channels) {
      if (!channel->present()) continue;
      columns_.push_back(name);
      samples_.push_back(channel->samples.data());
    }
  }
  ~ReplaySource() override { stop(); }
  [[nodiscard]] std::string_view promise() const noexcept override {
    return "The recording is read again from its beginning with the next start.";
  }

 private:
  void run() override {
    const double rate_hz = settings_.record->sample_rate_hz;
    const std::uint64_t total = settings_.record->samples();
    const auto start = std::chrono::steady_clock::now();
    set_state(SourceState::running);
    std::uint64_t next = 0;
    while (next < total && !stopping()) {
      const double elapsed_s =
          std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      const double due = elapsed_s * settings_.speed * rate_hz;
      const std::uint64_t end = settings_.speed > 0.0
                                    ? static_cast<std::uint64_t>(std::min(due, static_cast<double>(total)))
                                    : total;
      while (next < end && !stopping()) {
        const std::uint64_t count = std::min<std::uint64_t>(kReplayed, end - next);
        if (give(next, count)) next += count;
      }
      if (next < total && !wait(kReplayPiece_s)) return;
    }
    if (!stopping()) set_state(SourceState::ended, "the recording has come to its end");
  }

  [[nodiscard]] bool give(std::uint64_t first, std::uint64_t count) {
    const double rate_hz = settings_.record->sample_rate_hz;
    Arrival arrival;
    arrival.first_sample = first;
    arrival.time_ns = settings_.first_ns + std::llround(1e9 * static_cast<double>(first) / rate_hz);
    arrival.sample_rate_hz = rate_hz;
    arrival.columns = columns_;
    values_.clear();
    for (std::uint64_t k = first; k < first + count; ++k)
      for (const double* channel : samples_) values_.push_back(channel[k]);
    arrival.values = values_;
    delivery_.count_bytes(values_.size() * sizeof(double));
    return deliver(arrival);
  }

  const ReplaySettings settings_;
  std::vector<std::string_view> columns_;
  std::vector<const double*> samples_;  ///< [column]
  std::vector<double> values_;
};

}  // namespace

expected<std::unique_ptr<Source>, Error> make_replay_source(ReplaySettings settings, Axes& axes) {
  if (!settings.record || settings.record->samples() == 0) return refuse("record", "must hold samples");
  if (!(settings.speed >= 0.0)) return refuse("speed", "must be >= 0", settings.speed);
  return std::make_unique<ReplaySource>(std::move(settings), axes);
}

}  // namespace resonid::monitor
