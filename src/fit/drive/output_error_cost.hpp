// SPDX-License-Identifier: MIT
#pragma once

#include <ceres/cost_function.h>

#include <fit/drive/drive_simulation.hpp>
#include <fit/least_squares.hpp>
#include <span>
#include <vector>

namespace resonid::fit::detail {

/// Common coordinates: the physical ones and dry friction. A record's own ones follow, in the order of
/// kInitialState ..., dry friction left out.
inline constexpr int kCommonCoulomb = int{kParameterCount};
inline constexpr int kCommon = kCommonCoulomb + kFrictionCoordinates;
[[nodiscard]] constexpr int common_friction(int local) { return kCommonCoulomb + local - kCoulomb; }

/// Where a record's coordinates lie among all.
class CoordinateLayout {
 public:
  CoordinateLayout(std::size_t records, int controller_order)
      : records_(static_cast<int>(records)), own_(kControllerState - kCommon + controller_order) {}

  [[nodiscard]] int size() const { return kCommon + records_ * own_; }
  [[nodiscard]] int local_size() const { return kCommon + own_; }
  [[nodiscard]] int of(int record, int local) const {
    if (local < kParameterCount) return local;
    if (local >= kCoulomb && local < kBehind) return common_friction(local);
    return kCommon + record * own_ + local - kParameterCount - (local >= kBehind ? kFrictionCoordinates : 0);
  }
  [[nodiscard]] std::vector<double> local(int record, std::span<const double> x) const {
    std::vector<double> mine(static_cast<std::size_t>(local_size()));
    for (int i = 0; i < local_size(); ++i)
      mine[static_cast<std::size_t>(i)] = x[static_cast<std::size_t>(of(record, i))];
    return mine;
  }

 private:
  int records_, own_;
};

/// Sums over all records as a cost for Ceres, one triangular factor per record.
class OutputErrorCost : public ceres::CostFunction {
 public:
  struct Part {
    DriveSimulation simulation;
    double weight;
    std::vector<int> active;  // local
  };

  /// Keeps a reference to the layout. `checked`: as many coordinates as must lie in `range`.
  OutputErrorCost(std::vector<Part> parts, const CoordinateLayout& layout, const SearchRange& range,
                  int checked);

  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override;

 private:
  std::vector<Part> parts_;
  const CoordinateLayout& layout_;
  SearchRange range_;
  int checked_;
};

}  // namespace resonid::fit::detail
