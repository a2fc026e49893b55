// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <resonid/identification/track.hpp>
#include <resonid/identification/tune.hpp>
#include <utility>

namespace resonid::identification {
namespace {

constexpr std::size_t kLeastRows = 10;  ///< Of a stretch: fewer tell nothing of their scatter.
constexpr double kLittle = 0.05;        ///< Change of a parameter within a stretch, in its logarithm.
constexpr double kMuch = 0.2;           ///< Between neighbouring positions, across a gap.
constexpr int kMostHalvings = 6;

/// A parameter that the rows tell.
struct TrackedParameter {
  fit::Parameter parameter;
  const TrackSeries* series;
};

bool is_positive_by_nature(fit::Parameter p) {
  return p == fit::kDrivenInertia || p == fit::kLoadInertia || p == fit::kStiffness || p == fit::kDamping;
}

/// Trusted rows by ascending position; logarithms of what is positive by nature.
struct PositionedRows {
  std::vector<fit::Parameter> parameters;
  std::vector<double> position;  ///< [row]
  Eigen::MatrixXd value, std;    ///< (row, parameter)
};

/// What a stretch of position says.
struct Stretch {
  double from = 0.0, to = 0.0, centre = 0.0;  ///< Positions of the outermost rows, and their mean.
  Eigen::VectorXd middle, slope;              ///< [parameter] Straight line over position - centre.
  Eigen::VectorXd own;                        ///< [parameter] Mean variance that the rows give.
  Eigen::MatrixXd scatter;                    ///< Covariance around the line.

  [[nodiscard]] Eigen::VectorXd at(double position) const { return middle + slope * (position - centre); }
  [[nodiscard]] double std(Eigen::Index i) const { return std::sqrt(own(i) + scatter(i, i)); }
};

Stretch stretch_of(const PositionedRows& rows, std::size_t first, std::size_t last) {
  const auto begin = static_cast<Eigen::Index>(first), count = static_cast<Eigen::Index>(last - first);
  const Eigen::Map<const Eigen::VectorXd> position(rows.position.data() + first, count);
  const Eigen::MatrixXd value = rows.value.middleRows(begin, count);
  Stretch s;
  s.from = rows.position[first];
  s.to = rows.position[last - 1];
  s.centre = position.mean();
  const Eigen::VectorXd x = position.array() - s.centre;
  s.middle = value.colwise().mean().transpose();
  s.slope = value.transpose() * x / std::max(x.squaredNorm(), 1e-300);
  s.own = rows.std.middleRows(begin, count).array().square().colwise().mean().transpose();
  const Eigen::MatrixXd around =
      value - Eigen::VectorXd::Ones(count) * s.middle.transpose() - x * s.slope.transpose();
  s.scatter = around.transpose() * around / static_cast<double>(count - 2);
  return s;
}

/// Halves stretches until nothing changes much within one.
class Divider {
 public:
  explicit Divider(const PositionedRows& rows) : rows_(rows) {}

  std::vector<Stretch> run() {
    divide(0, rows_.position.size(), rows_.position.front(), rows_.position.back(), 0);
    return std::move(stretches_);
  }

 private:
  [[nodiscard]] bool changes_much(const Stretch& s) const {
    for (Eigen::Index i = 0; i < s.slope.size(); ++i) {
      if (!is_positive_by_nature(rows_.parameters[static_cast<std::size_t>(i)])) continue;
      if (std::abs(s.slope(i)) * (s.to - s.from) > std::max(kLittle, 2.0 * s.std(i))) return true;
    }
    return false;
  }

  void divide(std::size_t first, std::size_t last, double from, double to, int halvings) {
    if (last == first) return;  // a gap
    Stretch whole = stretch_of(rows_, first, last);
    const double middle = 0.5 * (from + to);
    const auto begin = rows_.position.begin();
    const auto half =
        static_cast<std::size_t>(std::lower_bound(begin + static_cast<std::ptrdiff_t>(first),
                                                  begin + static_cast<std::ptrdiff_t>(last), middle) -
                                 begin);
    const bool both = half - first >= kLeastRows && last - half >= kLeastRows;
    const bool one = half == first || half == last;  // the other half is a gap
    if (halvings == kMostHalvings || !changes_much(whole) || !(both || one)) {
      stretches_.push_back(std::move(whole));
      return;
    }
    divide(first, half, from, middle, halvings + 1);
    divide(half, last, middle, to, halvings + 1);
  }

  const PositionedRows& rows_;
  std::vector<Stretch> stretches_;
};

expected<std::vector<TrackedParameter>, Error> tracked_parameters(const Track& track) {
  std::vector<TrackedParameter> tracked;
  for (const fit::Parameter p :
       {fit::kDrivenInertia, fit::kLoadInertia, fit::kStiffness, fit::kDamping, fit::kViscousFriction}) {
    const auto* series = track.find(fit::kParameterNames[p]);
    if (series == nullptr || series->std.size() != series->value.size()) {
      if (p == fit::kViscousFriction) continue;
      return refuse("rows",
                    fmt::format("must have {0} and {0}_std, as a tracker of physical parameters gives them",
                                fit::kParameterNames[p]));
    }
    tracked.push_back({p, series});
  }
  return tracked;
}

expected<PositionedRows, Error> positioned_rows(const Track& track) {
  if (track.position_m.empty())
    return refuse("rows", "must have position_m: track a recording with a position");
  const auto tracked = tracked_parameters(track);
  if (!tracked) return tl::unexpected(tracked.error());
  std::vector<std::size_t> order;
  for (std::size_t row = 0; row < track.position_m.size(); ++row) {
    const bool usable = track.trusted_rows[row] && std::isfinite(track.position_m[row]) &&
                        std::all_of(tracked->begin(), tracked->end(), [&](const TrackedParameter& t) {
                          const double value = t.series->value[row], std = t.series->std[row];
                          return std::isfinite(value) && std::isfinite(std) &&
                                 (value > 0.0 || !is_positive_by_nature(t.parameter));
                        });
    if (usable) order.push_back(row);
  }
  if (order.size() < kLeastRows)
    return refuse("rows", fmt::format("must hold at least {} that are trusted", kLeastRows),
                  static_cast<double>(order.size()));
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return track.position_m[a] < track.position_m[b]; });
  PositionedRows rows;
  const auto count = static_cast<Eigen::Index>(order.size()),
             width = static_cast<Eigen::Index>(tracked->size());
  rows.value.resize(count, width);
  rows.std.resize(count, width);
  for (const std::size_t row : order) {
    const auto i = static_cast<Eigen::Index>(rows.position.size());
    rows.position.push_back(track.position_m[row]);
    for (Eigen::Index j = 0; j < width; ++j) {
      const TrackedParameter& t = (*tracked)[static_cast<std::size_t>(j)];
      const double value = t.series->value[row], std = t.series->std[row];
      const bool logarithm = is_positive_by_nature(t.parameter);
      rows.value(i, j) = logarithm ? std::log(value) : value;
      rows.std(i, j) = logarithm ? std / value : std;
    }
  }
  for (const auto& t : *tracked) rows.parameters.push_back(t.parameter);
  if (!(rows.position.back() > rows.position.front()))
    return refuse("rows", "must lie at several positions, and all trusted ones lie at one",
                  rows.position.front());
  return rows;
}

/// The result's model at a position of a stretch.
fit::DriveModel model_at(const fit::DriveModel& identified, const std::vector<fit::Parameter>& parameters,
                         const Stretch& stretch, double position) {
  fit::DriveModel model = identified;
  const Eigen::VectorXd value = stretch.at(position);
  const auto width = value.size();
  const auto parameter = [&](Eigen::Index i) { return parameters[static_cast<std::size_t>(i)]; };
  Eigen::VectorXd scale(width);  // from the rows' coordinates to the parameters themselves
  for (Eigen::Index i = 0; i < width; ++i) {
    const bool logarithm = is_positive_by_nature(parameter(i));
    model.set(parameter(i), logarithm ? std::exp(value(i)) : value(i));
    model.estimated[parameter(i)] = true;
    scale(i) = logarithm ? std::exp(value(i)) : 1.0;
    model.covariance.row(parameter(i)).setZero();
    model.covariance.col(parameter(i)).setZero();
  }
  // The rows tell their variances only; how errors go together is as the result has it.
  const auto& known = identified.covariance;
  for (Eigen::Index i = 0; i < width; ++i)
    for (Eigen::Index j = 0; j < width; ++j) {
      const double both = known(parameter(i), parameter(i)) * known(parameter(j), parameter(j));
      const double correlation = i == j       ? 1.0
                                 : both > 0.0 ? known(parameter(i), parameter(j)) / std::sqrt(both)
                                              : 0.0;
      model.covariance(parameter(i), parameter(j)) =
          scale(i) * scale(j) *
          (correlation * std::sqrt(stretch.own(i) * stretch.own(j)) + stretch.scatter(i, j));
    }
  return model;
}

/// Rows of another machine, or in other units, would be scheduled as readily.
expected<void, Error> check_machine(const fit::DriveModel& identified, const fit::DriveModel& tracked) {
  const auto total = [](const fit::DriveModel& m) {
    return m.parameters.driven_inertia + m.parameters.load_inertia;
  };
  const double ratio = total(tracked) / total(identified);
  constexpr double kSameMachine = 2.0;
  if (ratio > 1.0 / kSameMachine && ratio < kSameMachine) return {};
  return refuse("rows",
                fmt::format("must be of the machine and in the units of the result: their total inertia is "
                            "{:.3g}, the result's {:.3g}",
                            total(tracked), total(identified)));
}

/// What lies between two positions is interpolated: nobody has looked there.
expected<void, Error> check_gap(const Stretch& a, double from, const Stretch& b, double to,
                                const std::vector<fit::Parameter>& parameters) {
  const Eigen::VectorXd change = b.at(to) - a.at(from);
  for (Eigen::Index i = 0; i < change.size(); ++i) {
    const auto p = parameters[static_cast<std::size_t>(i)];
    if (!is_positive_by_nature(p)) continue;
    if (std::abs(change(i)) <= std::max(kMuch, 2.0 * std::hypot(a.std(i), b.std(i)))) continue;
    return refuse(
        "rows",
        fmt::format(
            "must be enough between the positions {:.4g} and {:.4g}, over which {} changes by {:.0f} %", from,
            to, fit::kParameterNames[p], 100.0 * std::abs(std::expm1(change(i)))));
  }
  return {};
}
expected<void, Error> check_gaps(const std::vector<Stretch>& stretches,
                                 const std::vector<fit::Parameter>& parameters) {
  for (std::size_t k = 0; k < stretches.size(); ++k) {
    const Stretch& here = stretches[k];
    if (auto inside = check_gap(here, here.from, here, here.to, parameters); !inside) return inside;
    if (k + 1 == stretches.size()) break;
    const Stretch& next = stretches[k + 1];
    if (auto between = check_gap(here, here.to, next, next.from, parameters); !between) return between;
  }
  return {};
}

}  // namespace

expected<ResultsOverPosition, Error> results_over_position(const Result& result, const Track& track) {
  if (!result.model || result.model->drive.structure != fit::Structure::two_mass)
    return refuse("results", "must hold a two-mass model: its parameters are what the rows follow");
  const auto rows = positioned_rows(track);
  if (!rows) return tl::unexpected(rows.error());
  const auto stretches = Divider(*rows).run();
  if (auto gaps = check_gaps(stretches, rows->parameters); !gaps) return tl::unexpected(gaps.error());
  ResultsOverPosition found;
  const auto put = [&](const Stretch& stretch, double position) {
    Result here = result;
    here.model->drive = model_at(result.model->drive, rows->parameters, stretch, position);
    found.positions.push_back(position);
    found.results.push_back(std::move(here));
  };
  put(stretches.front(), stretches.front().from);
  for (std::size_t k = 1; k + 1 < stretches.size(); ++k) put(stretches[k], stretches[k].centre);
  put(stretches.back(), stretches.back().to);
  for (const Result& here : found.results)
    if (auto same = check_machine(result.model->drive, here.model->drive); !same)
      return tl::unexpected(same.error());
  return found;
}

}  // namespace resonid::identification
