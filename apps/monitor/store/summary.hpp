// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <monitoring/row.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace resonid::monitor {

/// One figure over a stretch of time.
struct FigureSummary {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  std::uint32_t rows = 0;     ///< With a value.
  std::uint32_t trusted = 0;  ///< Of them. Where there are some, all that follows is of these alone.
  double mean = kUnknown;
  double spread = kUnknown;  ///< Rms about the mean.
  double min = kUnknown, max = kUnknown;
  /// Standard deviation of the mean; not known where nothing is trusted. +-1.96 of it cover in 92 ... 98 %
  /// the mean about which the machine wanders, as long as its wander forgets itself within a twelfth of the
  /// stretch; what is slower shows as differences between stretches.
  double std = kUnknown;
  double own_std = kUnknown;  ///< What the estimator's standard deviations and memory alone make of it.
};
using Summary = std::array<FigureSummary, monitoring::kWatched>;

/// Bytes of a summary, without the figures that have no rows; and back, or nothing where they are not such.
[[nodiscard]] std::string encode_summary(const Summary& summary);
[[nodiscard]] std::optional<Summary> decode_summary(std::string_view bytes) noexcept;

/// Standard deviation of the weighted mean of means over successive batches. Neighbouring batches may be
/// alike (their correlation is taken for that of a first-order process), and few batches count for less
/// (Student's t), so that +-1.96 of it cover in 95 %. Weights sum to 1. Not known below 4 batches.
[[nodiscard]] double std_of_mean(std::span<const double> batch_means, std::span<const double> weights);

/// Gathers rows of one figure in the order of time.
class FigureGatherer {
 public:
  void add(std::int64_t time_ns, const online::Figure& figure, bool trusted);
  /// Over all rows so far. Errors of rows `memory_s` apart are taken to be correlated by 1/e; 0: not at all.
  [[nodiscard]] FigureSummary summary(double memory_s) const;
  void clear();

 private:
  struct Rows {
    std::vector<std::int64_t> times_ns;
    std::vector<double> values, stds;
  };
  Rows trusted_, others_;
};

/// The stretches together: of one day from its hours, of years from days. All are equally long; errors
/// `memory` of them apart are taken to be correlated by 1/e, 0: not at all.
[[nodiscard]] FigureSummary combine(std::span<const FigureSummary> stretches, double memory = 0.0);

}  // namespace resonid::monitor
