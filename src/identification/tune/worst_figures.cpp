// SPDX-License-Identifier: MIT
#include "identification/tune/worst_figures.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "design/figures.hpp"
#include "linalg/parallel.hpp"

namespace resonid::identification {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

class WorstFigures {
 public:
  WorstFigures(const design::Posterior& posterior, double radius, const SeveritiesOf& severities_of)
      : posterior_(posterior), radius_(radius), severities_of_(severities_of) {}

  std::vector<std::optional<double>> run() {
    const std::vector<Eigen::VectorXd> centre = {Eigen::VectorXd::Zero(posterior_.dimension())};
    const Eigen::VectorXd nominal = values_at(centre).front();
    if (unstable_) return {};
    const auto slopes = slopes_at(centre);
    if (unstable_) return {};
    std::vector<Edge> edges;
    for (auto f = static_cast<Eigen::Index>(design::kTransfers.size()); f < nominal.size(); ++f)
      add_edge(edges, slopes.front(), f);
    const auto reached = values_at(places_of(edges));
    if (unstable_) return {};
    for (std::size_t e = 0; e < edges.size(); ++e)
      std::erase_if(edges[e].figures, [&](Eigen::Index f) {
        return is_as_foreseen(reached[e](f) - nominal(f), radius_ * slopes.front().row(f).norm());
      });
    std::erase_if(edges, [](const Edge& edge) { return edge.figures.empty(); });
    look_again_from(edges);
    if (unstable_) return {};
    std::vector<std::optional<double>> worst;
    for (const double severity : worst_)
      worst.push_back(std::isnan(severity) ? std::nullopt : std::optional(severity));
    return worst;
  }

 private:
  /// Where the slopes of some figures lead to, one place for those that agree.
  struct Edge {
    Eigen::VectorXd place;
    std::vector<Eigen::Index> figures;
  };

  /// A figure that is nearly linear is worst where its slope leads to.
  static bool is_as_foreseen(double change, double foreseen) {
    constexpr double kNear = 0.1;
    return std::abs(change - foreseen) <= kNear * foreseen;
  }

  void look_again_from(std::vector<Edge> edges) {
    constexpr int kRounds = 2;
    for (int round = 0; round < kRounds && !edges.empty(); ++round) {
      const auto slopes = slopes_at(places_of(edges));
      std::vector<Edge> again;
      for (std::size_t e = 0; e < edges.size(); ++e)
        for (const Eigen::Index f : edges[e].figures) add_edge(again, slopes[e], f);
      values_at(places_of(again));
      edges = std::move(again);
    }
  }

  void add_edge(std::vector<Edge>& edges, const Eigen::MatrixXd& slopes, Eigen::Index figure) const {
    constexpr double kSame = 0.98;  // cosine
    const Eigen::VectorXd along = slopes.row(figure).transpose();
    if (!along.allFinite() || !(radius_ * along.norm() > 0.0)) return;
    const Eigen::VectorXd place = radius_ * along.normalized();
    const auto same = std::ranges::find_if(
        edges, [&](const Edge& other) { return other.place.dot(place) > kSame * radius_ * radius_; });
    if (same == edges.end()) return edges.push_back({place, {figure}});
    same->figures.push_back(figure);
  }

  [[nodiscard]] static std::vector<Eigen::VectorXd> places_of(const std::vector<Edge>& edges) {
    std::vector<Eigen::VectorXd> places;
    for (const auto& edge : edges) places.push_back(edge.place);
    return places;
  }

  /// A column of severities at each point; those inside the ellipsoid count.
  std::vector<Eigen::VectorXd> values_at(const std::vector<Eigen::VectorXd>& points) {
    std::vector<std::optional<std::vector<double>>> found(points.size());
    linalg::for_each_index(points.size(), 0, [&](std::size_t i) {
      found[i] = severities_of_(design::Machine(posterior_.at(points[i]), posterior_.known_to_hz()));
    });
    std::vector<Eigen::VectorXd> columns;
    for (std::size_t i = 0; i < points.size(); ++i) {
      constexpr double kRounding = 1.0 + 1e-9;
      const bool inside = points[i].norm() <= kRounding * radius_;
      if (found[i]) {
        columns.emplace_back(
            Eigen::Map<const Eigen::VectorXd>(found[i]->data(), static_cast<Eigen::Index>(found[i]->size())));
        if (inside) count(columns.back());
      } else {
        unstable_ = unstable_ || inside;
        columns.emplace_back(Eigen::VectorXd::Constant(static_cast<Eigen::Index>(worst_.size()), kUnknown));
      }
    }
    return columns;
  }

  /// What is once unknown stays so.
  void count(const Eigen::VectorXd& column) {
    worst_.resize(static_cast<std::size_t>(column.size()), -std::numeric_limits<double>::infinity());
    for (std::size_t f = 0; f < worst_.size(); ++f) {
      const double value = column(static_cast<Eigen::Index>(f));
      if (std::isnan(value) || value > worst_[f]) worst_[f] = value;
    }
  }

  /// Slopes of every figure (rows) at every point, by wide steps, since settling moves by whole samples and
  /// swings; unknown beside an unstable machine.
  std::vector<Eigen::MatrixXd> slopes_at(const std::vector<Eigen::VectorXd>& points) {
    constexpr double kStep = 0.25;
    const Eigen::Index dimension = posterior_.dimension();
    std::vector<Eigen::VectorXd> beside;
    for (const auto& point : points)
      for (Eigen::Index i = 0; i < dimension; ++i)
        for (const double step : {kStep, -kStep}) {
          beside.push_back(point);
          beside.back()(i) += step;
        }
    const auto values = values_at(beside);
    std::vector<Eigen::MatrixXd> slopes;
    for (std::size_t p = 0; p < points.size(); ++p) {
      Eigen::MatrixXd slope(static_cast<Eigen::Index>(worst_.size()), dimension);
      for (Eigen::Index i = 0; i < dimension; ++i) {
        const auto at = 2 * (p * static_cast<std::size_t>(dimension) + static_cast<std::size_t>(i));
        slope.col(i) = (values[at] - values[at + 1]) / (2.0 * kStep);
      }
      slopes.push_back(std::move(slope));
    }
    return slopes;
  }

  const design::Posterior& posterior_;
  double radius_;
  const SeveritiesOf& severities_of_;
  std::vector<double> worst_;  ///< [figure], by severity_of().
  bool unstable_ = false;
};

}  // namespace

std::vector<std::optional<double>> worst_figures(const design::Posterior& posterior, double radius,
                                                 const SeveritiesOf& severities_of) {
  return WorstFigures(posterior, radius, severities_of).run();
}

double least_bandwidth_hz(const design::Posterior& posterior, double radius, const Law& law) {
  const std::size_t bandwidth = figure_index("load_bandwidth_hz");
  const auto worst = worst_figures(
      posterior, radius, [&](const design::Machine& machine) -> std::optional<std::vector<double>> {
        const auto figures = design::figures_of(machine, law.linear, 0.3);
        if (!figures.stable) return std::nullopt;
        std::vector<double> severities(figure_count(), kUnknown);
        severities[bandwidth] = severity_of(bandwidth, figures.load_bandwidth_hz.value_or(0.0));
        return severities;
      });
  if (bandwidth >= worst.size() || !worst[bandwidth]) return 0.0;
  return value_of_severity(bandwidth, *worst[bandwidth], 0.0);
}

}  // namespace resonid::identification
