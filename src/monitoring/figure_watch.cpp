// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <monitoring/figure_watch.hpp>
#include <utility>

namespace resonid::monitoring {
namespace {

constexpr std::uint64_t kBlocksBack = 16;
constexpr double kGrown = 2.0;
constexpr double kLoadJump = 5.0, kLoadStep = 40.0;  // standard deviations from row to row
constexpr double kUnsure = 1.5;  // doubt after one: what it moves reaches 8 standard deviations of a block
constexpr std::uint64_t kUnsureBlocks = 1;
constexpr double kBack = 1.0 / 3.0;                   // of the change: it has gone
constexpr std::uint64_t kMostMissedRows = 1'000'000;  // told one by one

/// An estimator's figures err more than normal numbers do, the more so the rarer. Over 5100 hours of drives
/// with friction and load steps there were 2.4 times as many alarms as stated at 6e6 blocks, and 0.7 times at
/// 6e4: the interval that the detector is told is longer by this.
double rarer_than_normal(double blocks) {
  constexpr double kAlike = 6e4, kTail = 0.25;
  return std::pow(std::max(1.0, blocks / kAlike), kTail);
}

template <std::size_t... I>
auto copies(const auto& one, std::index_sequence<I...>) {
  return std::array{(static_cast<void>(I), one)...};
}

}  // namespace

FigureWatch::FigureWatch(const Detector& detector, double values_back, double false_alarm_interval_s) noexcept
    : figures_(copies(Watching{detector}, std::make_index_sequence<kWatched>{})),
      values_back_(values_back),
      false_alarm_interval_s_(false_alarm_interval_s) {}

double FigureWatch::learning_s(double block_s, double baseline_s) noexcept {
  constexpr double kFewestBlocks = 16.0;
  return std::max(baseline_s, kFewestBlocks * block_s);
}

expected<FigureWatch, Error> FigureWatch::create(double row_s, double block_s, double baseline_s,
                                                 double false_alarm_interval_s) {
  online::ChangeDetectorConfig c;
  c.sample_rate_hz = 1.0 / row_s;
  c.block_s = block_s;
  c.baseline_s = learning_s(block_s, baseline_s);
  c.false_alarm_interval_s = false_alarm_interval_s * rarer_than_normal(false_alarm_interval_s / block_s);
  const auto detector = Detector::create(c);
  if (!detector) return tl::unexpected(detector.error());
  return FigureWatch(*detector, static_cast<double>(kBlocksBack) * block_s / row_s, false_alarm_interval_s);
}

void FigureWatch::step(const Row& row, const AxisAlarmSettings& settings) noexcept {
  look_for_load_jump(row);
  const double doubt = unsure_rows_ > 0 ? kUnsure : 1.0;
  if (unsure_rows_ > 0) --unsure_rows_;
  for (std::size_t i = 0; i < kWatched; ++i) {
    const auto& f = row.figures[i];
    const double value = row.trusted ? f.value : online::AxisRow::kUnknown;
    auto& detector = figures_[i].detector;
    const bool known = detector.alarm();
    figures_[i].grown = false;
    detector.step(value, f.std > 0.0 ? f.std : 1.0, doubt);
    if (detector.alarm() && !known) {
      figures_[i].told = std::abs(detector.change().size);
      if (figures_[i].told < settings.figures[i].least_change) detector.resume();
    }
    look_back(figures_[i], value);
  }
}

void FigureWatch::look_for_load_jump(const Row& row) noexcept {
  const auto& [value, deviation] = row[Watched::load_torque];
  if (!row.trusted || !std::isfinite(value)) return;
  // Larger ones the tracker recognises, and takes back what it learned from them. False where there is no
  // std.
  const double jump = std::abs(value - load_torque_);
  if (jump > kLoadJump * deviation && jump < kLoadStep * deviation)
    unsure_rows_ = kUnsureBlocks * static_cast<std::uint64_t>(values_back_) / kBlocksBack;
  load_torque_ = value;
}

void FigureWatch::look_back(Watching& w, double value) const noexcept {
  if (!w.detector.alarm()) {
    w.values = 0;
    return;
  }
  if (!std::isfinite(value)) return;
  ++w.values;
  w.recent += (value - w.recent) / std::min(static_cast<double>(w.values), values_back_);
  if (static_cast<double>(w.values) < values_back_) return;
  const double off = std::abs(w.recent - w.detector.baseline());
  if (off < kBack * std::abs(w.detector.change().size)) {
    w.detector.resume();
    w.values = 0;
  } else if (off > kGrown * w.told) {
    w.detector.measure_from(kBlocksBack);
    w.told = std::max(off, std::abs(w.detector.change().size));
    w.grown = true;
  }
}

void FigureWatch::miss(std::uint64_t rows) noexcept {
  for (std::uint64_t i = 0; i < std::min(rows, kMostMissedRows); ++i)
    for (auto& w : figures_) w.detector.step(online::AxisRow::kUnknown);
}

std::array<FigureChange, kWatched> FigureWatch::changes(double first_s) const noexcept {
  std::array<FigureChange, kWatched> all;
  for (std::size_t i = 0; i < kWatched; ++i) {
    const Detector& d = figures_[i].detector;
    if (!d.ready()) continue;
    all[i].before = d.baseline();
    all[i].before_std = d.baseline_std();
    if (!d.alarm()) continue;
    all[i].changed = true;
    all[i].grown = figures_[i].grown;
    all[i].change = d.change();
    all[i].change.time_s += first_s;
    all[i].change.detected_s += first_s;
  }
  return all;
}

bool FigureWatch::intact() const noexcept {
  return std::all_of(figures_.begin(), figures_.end(), [](const Watching& w) { return w.detector.intact(); });
}

}  // namespace resonid::monitoring
