// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <identification/compare/replicas.hpp>
#include <identification/criteria.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <tuple>

namespace resonid::identification::detail {
namespace {

const std::vector<double>* replicas_of(const Result& result, const std::string& figure) {
  if (!result.bootstrap) return nullptr;
  for (const auto& i : result.bootstrap->intervals)
    if (i.name == figure && !i.values.empty()) return &i.values;
  return nullptr;
}

/// Replica of the second result beside one of the first: far off, since with equal seeds replicas of one
/// number have the same noise.
std::size_t partner(std::size_t replica, std::size_t count) { return (replica + count / 2) % count; }

/// As figures() calls it: the name tells the unit.
std::string figure_of(const Difference& d) {
  std::string name = d.name;
  if (const auto first = name.rfind("_1"); first != std::string::npos && first + 2 == name.size())
    name.erase(first);
  if (d.unit == "Hz") name += "_hz";
  if (d.unit == "deg") name += "_deg";
  if (d.unit == "dB") name += "_db";
  return name;
}

std::pair<double, double> middle_part(std::vector<double> values, double confidence) {
  std::sort(values.begin(), values.end());
  const double tail = 0.5 * (1.0 - confidence);
  return {ordered_quantile(values, tail), ordered_quantile(values, 1.0 - tail)};
}

/// The estimated parameters of a model with their replicas.
class ModelReplicas {
 public:
  explicit ModelReplicas(const Result& result) : drive_(result.model->drive) {
    for (int i = 0; i < fit::kParameterCount; ++i) {
      if (!drive_.estimated[static_cast<std::size_t>(i)]) continue;
      const auto* values =
          replicas_of(result, std::string(fit::kParameterNames[static_cast<std::size_t>(i)]));
      if (values == nullptr) {
        columns_.clear();
        return;
      }
      columns_.push_back({i, values});
    }
  }

  [[nodiscard]] std::size_t count() const { return columns_.empty() ? 0 : columns_.front().values->size(); }
  [[nodiscard]] bool same_parameters(const ModelReplicas& other) const {
    return std::equal(columns_.begin(), columns_.end(), other.columns_.begin(), other.columns_.end(),
                      [](const Column& a, const Column& b) { return a.parameter == b.parameter; });
  }

  [[nodiscard]] fit::DriveModel model(std::size_t replica) const { return moved(replica, drive_); }
  /// The replica's deviations on another model.
  [[nodiscard]] fit::DriveModel moved(std::size_t replica, fit::DriveModel onto) const {
    for (const auto& c : columns_) {
      const auto p = static_cast<fit::Parameter>(c.parameter);
      const double value = (*c.values)[replica], own = drive_.value(p), target = onto.value(p);
      const bool relative = fit::has_parameter(drive_.structure, p);
      onto = onto.moved(c.parameter, relative ? target * (value / own - 1.0) : value - own);
    }
    return onto;
  }

 private:
  struct Column {
    int parameter;
    const std::vector<double>* values;
  };
  const fit::DriveModel& drive_;
  std::vector<Column> columns_;
};

}  // namespace

std::optional<std::pair<double, double>> interval_of(const Difference& difference, const Result& first,
                                                     const Result& second, double confidence) {
  const auto name = figure_of(difference);
  const auto *a = replicas_of(first, name), *b = replicas_of(second, name);
  if (a == nullptr || b == nullptr) return std::nullopt;
  std::vector<double> changes;
  for (std::size_t i = 0; i < std::min(a->size(), b->size()); ++i)
    changes.push_back((*b)[partner(i, b->size())] - (*a)[i]);
  if (changes.size() < kCriteria.fewest_pairs) return std::nullopt;
  return middle_part(std::move(changes), confidence);
}

std::optional<GapBootstrap> bootstrapped(const ModelGap& gap, const Result& first, const Result& second,
                                         double confidence) {
  const ModelReplicas a(first), b(second);
  const auto of_models = gap(first.model->drive, second.model->drive);
  if (!of_models || !a.same_parameters(b)) return std::nullopt;
  std::vector<double> apart, alike;
  for (std::size_t i = 0; i < std::min(a.count(), b.count()); ++i) {
    const auto one = a.model(i);
    const std::size_t other = partner(i, b.count());
    const auto two = gap(one, b.model(other)), same = gap(one, b.moved(other, first.model->drive));
    if (!two || !same) continue;
    apart.push_back(*two);
    alike.push_back(*same);
  }
  if (apart.size() < 2) return std::nullopt;
  GapBootstrap result;
  result.pairs = apart.size();
  std::tie(result.low, result.high) = middle_part(apart, confidence);
  std::sort(alike.begin(), alike.end());
  result.noise = ordered_quantile(alike, confidence);
  const auto as_large = std::count_if(alike.begin(), alike.end(), [&](double g) { return g >= *of_models; });
  result.probability = (1.0 + static_cast<double>(as_large)) / (1.0 + static_cast<double>(alike.size()));
  return result;
}

}  // namespace resonid::identification::detail
