// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/diagnostics/change_detection.hpp>

namespace resonid::diagnostics {

template <class Real, std::size_t MaxWindow>
expected<ChangeDetector<Real, MaxWindow>, ConfigError> ChangeDetector<Real, MaxWindow>::create(
    const ChangeDetectorConfig& config) noexcept {
  const auto positive = [](double x) { return x > 0.0 && std::isfinite(x); };
  constexpr double kLeastBlocks = 16.0, kLeastInterval = 50.0;
  if (!positive(config.sample_rate_hz)) return refuse("sample_rate_hz", "must be > 0", config.sample_rate_hz);
  if (!positive(config.block_s) || config.block_s * config.sample_rate_hz < 0.999)
    return refuse("block_s", "must be at least a sample long", config.block_s);
  if (!positive(config.baseline_s) || config.baseline_s < kLeastBlocks * config.block_s)
    return refuse("baseline_s", "must be at least 16 blocks long", config.baseline_s);
  if (!positive(config.false_alarm_interval_s) ||
      config.false_alarm_interval_s < kLeastInterval * config.block_s)
    return refuse("false_alarm_interval_s", "must be at least 50 blocks long", config.false_alarm_interval_s);
  if (!(config.reference >= 0.05 && config.reference <= 3.0))
    return refuse("reference", "must be 0.05 ... 3", config.reference);
  if (config.window_blocks < 1 || config.window_blocks > MaxWindow)
    return refuse("window_blocks", "must be 1 ... MaxWindow", static_cast<double>(config.window_blocks));
  return ChangeDetector(config);
}

template <class Real, std::size_t MaxWindow>
ChangeDetector<Real, MaxWindow>::ChangeDetector(const ChangeDetectorConfig& config) noexcept
    : config_(config) {
  block_samples_ = static_cast<std::size_t>(std::lround(config.block_s * config.sample_rate_hz));
  const double run_length = config.false_alarm_interval_s / config.block_s;
  if (config.statistic == ChangeStatistic::cusum)
    cusum_ = Cusum(config.reference, cusum_threshold(config.reference, run_length));
  else
    likelihood_ratio_ = LikelihoodRatio<MaxWindow>(
        config.window_blocks, likelihood_ratio_threshold(config.window_blocks, run_length));
}

template <class Real, std::size_t MaxWindow>
void ChangeDetector<Real, MaxWindow>::step(Real value, Real standard_deviation) noexcept {
  ++samples_;
  const double x = static_cast<double>(value), sd = static_cast<double>(standard_deviation);
  const double precision = 1.0 / (sd * sd);
  if (std::isfinite(x) && sd > 0.0 && precision > 0.0 && std::isfinite(precision)) {
    sum_ += precision * x;
    precision_ += precision;
    ++seen_in_block_;
  } else {
    ++skipped_;
  }
  if (++in_block_ == block_samples_) end_block();
}

template <class Real, std::size_t MaxWindow>
void ChangeDetector<Real, MaxWindow>::end_block() noexcept {
  const bool enough = 2 * seen_in_block_ >= block_samples_ && seen_in_block_ > 0;
  const double sum = sum_, precision = precision_;
  sum_ = precision_ = 0.0;
  in_block_ = seen_in_block_ = 0;
  if (!enough || !std::isfinite(sum)) return;
  past_[blocks_ % MaxWindow] = {sum, precision, samples_};
  ++blocks_;
  if (alarm_) {
    after_sum_ += sum;
    after_precision_ += precision;
    return;
  }
  watch(sum / precision, precision);
}

template <class Real, std::size_t MaxWindow>
void ChangeDetector<Real, MaxWindow>::watch(double mean, double precision) noexcept {
  const bool watching = ready();
  const double standard = baseline_.step(mean, precision);
  if (!watching) return;
  judge(config_.statistic == ChangeStatistic::cusum ? cusum_.step(standard)
                                                    : likelihood_ratio_.step(standard));
}

template <class Real, std::size_t MaxWindow>
void ChangeDetector<Real, MaxWindow>::judge(const ChangeStatisticState& state) noexcept {
  level_ = state.level;
  if (level_ < 1.0) return;
  alarm_ = true;
  alarm_sample_ = samples_;
  // The mean before the change is that of the baseline without the blocks since.
  const std::uint64_t since =
      std::min<std::uint64_t>(state.since, std::min<std::uint64_t>(blocks_, MaxWindow));
  after_sum_ = after_precision_ = 0.0;
  for (std::uint64_t i = blocks_ - since; i < blocks_; ++i) {
    const Block& block = past_[i % MaxWindow];
    after_sum_ += block.sum;
    after_precision_ += block.precision;
  }
  const double all = baseline_.total_precision();
  const double before = std::max(all - after_precision_, 1e-9 * all);
  before_mean_ = (all * baseline_.mean() - after_sum_) / before;
  const double unit = baseline_.mean_std(1.0);
  before_variance_ = unit * unit / before;
  const std::uint64_t first = blocks_ - since;
  change_sample_ = since < MaxWindow && first > 0 ? past_[(first - 1) % MaxWindow].end_sample
                                                  : samples_ - std::min(samples_, since * block_samples_);
}

template <class Real, std::size_t MaxWindow>
void ChangeDetector<Real, MaxWindow>::relearn() noexcept {
  ChangeDetector fresh(config_);
  fresh.samples_ = samples_;
  fresh.skipped_ = skipped_;
  *this = fresh;
}

template <class Real, std::size_t MaxWindow>
Change ChangeDetector<Real, MaxWindow>::change() const noexcept {
  if (!alarm_) return {};
  const double unit = baseline_.mean_std(1.0);
  return {static_cast<double>(change_sample_) / config_.sample_rate_hz,
          static_cast<double>(alarm_sample_) / config_.sample_rate_hz,
          after_sum_ / after_precision_ - before_mean_,
          std::sqrt(before_variance_ + unit * unit / after_precision_)};
}

template <class Real, std::size_t MaxWindow>
double ChangeDetector<Real, MaxWindow>::threshold() const noexcept {
  return config_.statistic == ChangeStatistic::cusum ? cusum_.threshold() : likelihood_ratio_.threshold();
}

template <class Real, std::size_t MaxWindow>
double ChangeDetector<Real, MaxWindow>::block_std() const noexcept {
  if (baseline_.values() == 0 || blocks_ == 0) return std::numeric_limits<double>::infinity();
  const double phi = baseline_.phi();
  // A block about its mean: of an autoregression of first order, sqrt(1/(1 - phi^2)) times its innovation.
  const double typical = baseline_.total_precision() / static_cast<double>(baseline_.values());
  return baseline_.mean_std(typical) * (1.0 - phi) / std::sqrt(1.0 - phi * phi);
}

}  // namespace resonid::diagnostics
