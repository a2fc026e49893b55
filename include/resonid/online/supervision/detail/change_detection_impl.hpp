// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <resonid/online/supervision/change_detection.hpp>

namespace resonid::online {

template <class Real, std::size_t MaxWindow>
std::optional<Error> ChangeDetector<Real, MaxWindow>::fault_of(const ChangeDetectorConfig& config) noexcept {
  constexpr double kLeastBlocks = 16.0, kLeastInterval = 50.0;
  if (!positive(config.sample_rate_hz)) return Error{"sample_rate_hz", "must be > 0", config.sample_rate_hz};
  if (!positive(config.block_s) || config.block_s * config.sample_rate_hz < 0.999)
    return Error{"block_s", "must be at least a sample long", config.block_s};
  if (!positive(config.baseline_s) || config.baseline_s < kLeastBlocks * config.block_s)
    return Error{"baseline_s", "must be at least 16 blocks long", config.baseline_s};
  if (!positive(config.false_alarm_interval_s) ||
      config.false_alarm_interval_s < kLeastInterval * config.block_s)
    return Error{"false_alarm_interval_s", "must be at least 50 blocks long", config.false_alarm_interval_s};
  if (!(config.reference >= 0.05 && config.reference <= 3.0))
    return Error{"reference", "must be 0.05 ... 3", config.reference};
  if (config.window_blocks < 1 || config.window_blocks > MaxWindow)
    return Error{"window_blocks", "must be 1 ... MaxWindow", static_cast<double>(config.window_blocks)};
  return std::nullopt;
}

template <class Real, std::size_t MaxWindow>
expected<ChangeDetector<Real, MaxWindow>, Error> ChangeDetector<Real, MaxWindow>::create(
    const ChangeDetectorConfig& config) noexcept {
  if (auto fault = fault_of(config)) return unexpected<Error>(*fault);
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
void ChangeDetector<Real, MaxWindow>::step(Real value, Real standard_deviation, Real doubt) noexcept {
  ++samples_;
  doubt_ = std::max(doubt_, static_cast<double>(doubt));
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
  const double sum = sum_, precision = precision_, doubt = doubt_;
  sum_ = precision_ = 0.0;
  doubt_ = 1.0;
  in_block_ = seen_in_block_ = 0;
  if (!enough || !std::isfinite(sum)) return;
  const bool watching = ready() && blocks_ > 0;
  const Block now{sum, precision, samples_};
  const Block before = blocks_ > 0 ? past_[slot(blocks_ - 1)] : now;
  past_[slot(blocks_)] = now;
  ++blocks_;
  if (alarm_) {
    after_sum_ += sum;
    after_precision_ += precision;
    return;
  }
  learn();
  if (watching) watch(now, before, doubt);
}

template <class Real, std::size_t MaxWindow>
void ChangeDetector<Real, MaxWindow>::learn() noexcept {
  // All of the baseline at once, then one block for one that leaves the window.
  const std::uint64_t until =
      ready() ? std::max(learned_, blocks_ - std::min<std::uint64_t>(blocks_, config_.window_blocks))
              : blocks_;
  for (; learned_ < until; ++learned_) {
    const Block& block = past_[slot(learned_)];
    const Block& before = past_[slot(learned_ > 0 ? learned_ - 1 : 0)];
    const double distance = distance_of(before, block);
    if (baseline_.values() >= kGroup)
      gather(baseline_.standardised(block.mean(), before.mean(), block.precision, distance));
    baseline_.learn(block.mean(), block.precision, distance);
  }
}

template <class Real, std::size_t MaxWindow>
void ChangeDetector<Real, MaxWindow>::gather(double standardised) noexcept {
  group_sum_ += standardised;
  if (++in_group_ < kGroup) return;
  group_squares_ += group_sum_ * group_sum_;
  groups_ += 1.0;
  group_sum_ = 0.0;
  in_group_ = 0;
}

template <class Real, std::size_t MaxWindow>
void ChangeDetector<Real, MaxWindow>::watch(const Block& now, const Block& before, double doubt) noexcept {
  const double x =
      baseline_.standardised(now.mean(), before.mean(), now.precision, distance_of(before, now)) / doubt;
  const Certainty known{baseline_.shared(), baseline_.degrees()};
  judge(config_.statistic == ChangeStatistic::cusum ? cusum_.step(x, known)
                                                    : likelihood_ratio_.step(x, known));
}

template <class Real, std::size_t MaxWindow>
void ChangeDetector<Real, MaxWindow>::judge(const ChangeStatisticState& state) noexcept {
  level_ = state.level;
  if (level_ < 1.0) return;
  alarm_ = true;
  alarm_sample_ = samples_;
  const std::uint64_t since = std::min<std::uint64_t>({state.since, blocks_ - 1, MaxWindow});
  const std::uint64_t first = blocks_ - since;
  measure_after(first);
  change_sample_ = past_[slot(first - 1)].end_sample;
  before_mean_ = baseline_.mean();
  before_variance_ = std::pow(baseline_.mean_std(baseline_.total_precision()), 2);
}

template <class Real, std::size_t MaxWindow>
void ChangeDetector<Real, MaxWindow>::measure_after(std::uint64_t first) noexcept {
  after_sum_ = after_precision_ = 0.0;
  for (std::uint64_t i = first; i < blocks_; ++i) {
    after_sum_ += past_[slot(i)].sum;
    after_precision_ += past_[slot(i)].precision;
  }
}

template <class Real, std::size_t MaxWindow>
void ChangeDetector<Real, MaxWindow>::measure_from(std::uint64_t blocks) noexcept {
  if (alarm_ && blocks > 0) measure_after(blocks_ - std::min<std::uint64_t>({blocks, blocks_, MaxWindow}));
}

template <class Real, std::size_t MaxWindow>
void ChangeDetector<Real, MaxWindow>::resume() noexcept {
  if (!alarm_) return;
  alarm_ = false;
  level_ = 0.0;
  learned_ = blocks_;
  cusum_.reset();
  likelihood_ratio_.reset();
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
  if (blocks_ == 0) return std::numeric_limits<double>::infinity();
  const double typical = baseline_.total_precision() / static_cast<double>(baseline_.values());
  return baseline_.innovation_std() / std::sqrt(typical);
}

}  // namespace resonid::online
