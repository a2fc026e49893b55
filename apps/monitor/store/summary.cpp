// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstring>
#include <monitor/store/summary.hpp>

namespace resonid::monitor {
namespace {

constexpr double kNormal95 = 1.959963985;  // quantile of the normal distribution at 97.5 %
constexpr std::size_t kBatches = 20;       // of a stretch; more do not see wander, fewer do not tell its size
constexpr double kLeastBatches = 4.0;

/// Student's t at 97.5 % over the normal quantile, by Cornish and Fisher's expansion; 3 % low at 2 degrees of
/// freedom, less above.
double student_over_normal(double freedom) {
  const double z = kNormal95, z2 = z * z, n = freedom;
  const double first = (z2 + 1) / (4 * n);
  const double second = ((5 * z2 + 16) * z2 + 3) / (96 * n * n);
  const double third = (((3 * z2 + 19) * z2 + 17) * z2 - 15) / (384 * n * n * n);
  return 1 + first + second + third;
}

double square(double x) { return x * x; }

/// Of the mean of n estimates with standard deviation `sigma`, correlated exponentially over `memory` of
/// them.
double std_by_memory(double sigma, double memory, double n) {
  if (memory <= 0.0) return sigma / std::sqrt(n);
  const double step = -std::expm1(-1.0 / memory), kept = 1.0 - step;
  const double ratio = ((1 + kept) / step + 2 * kept * std::expm1(-n / memory) / (n * square(step))) / n;
  return sigma * std::sqrt(std::clamp(ratio, 0.0, 1.0));
}

/// By how much the standard deviation of the mean of `n` successive stretches is larger than if their errors
/// were independent; correlated exponentially over `memory` stretches.
double alike_by_memory(double memory, double n) {
  if (memory <= 0.0 || n < 2.0) return 1.0;
  // Variance of the mean over x memories, of a process of variance 1.
  const auto variance = [](double x) { return 2.0 * (x + std::expm1(-x)) / square(x); };
  return std::sqrt(std::max(1.0, n * variance(n / memory) / variance(1.0 / memory)));
}

/// The larger of two, where known.
double larger_known(double a, double b) { return std::isnan(a) ? b : std::isnan(b) ? a : std::max(a, b); }

double median_step_s(const std::vector<std::int64_t>& times_ns) {
  if (times_ns.size() < 2) return 0.0;
  std::vector<double> steps(times_ns.size() - 1);
  for (std::size_t i = 0; i < steps.size(); ++i)
    steps[i] = static_cast<double>(times_ns[i + 1] - times_ns[i]) * 1e-9;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

void describe(std::span<const double> values, FigureSummary& summary) {
  double sum = 0.0, squares = 0.0;
  for (const double value : values) sum += value;
  const auto n = static_cast<double>(values.size());
  summary.mean = sum / n;
  for (const double value : values) squares += square(value - summary.mean);
  summary.spread = std::sqrt(squares / n);
  const auto [min, max] = std::minmax_element(values.begin(), values.end());
  summary.min = *min;
  summary.max = *max;
}

double std_by_batches(std::span<const double> values) {
  const std::size_t n = values.size(), batches = std::min(n, kBatches);
  std::array<double, kBatches> means{}, weights{};
  for (std::size_t b = 0; b < batches; ++b) {
    const std::size_t from = b * n / batches, to = (b + 1) * n / batches;
    for (std::size_t i = from; i < to; ++i) means[b] += values[i];
    means[b] /= static_cast<double>(to - from);
    weights[b] = static_cast<double>(to - from) / static_cast<double>(n);
  }
  return std_of_mean(std::span(means).first(batches), std::span(weights).first(batches));
}

constexpr std::size_t kSummaryDoubles = 6, kSummaryBytes = 8 + kSummaryDoubles * sizeof(double);
constexpr double FigureSummary::*kSummaryFields[kSummaryDoubles] = {
    &FigureSummary::mean, &FigureSummary::spread, &FigureSummary::min,
    &FigureSummary::max,  &FigureSummary::std,    &FigureSummary::own_std};
constexpr char kSummaryFormat = 1;
constexpr std::size_t kSummaryHeader = 3;  // format, mask of the figures

template <class T>
void append_raw(std::string& bytes, T value) {
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  bytes.append(raw, sizeof raw);
}

}  // namespace

std::string encode_summary(const Summary& summary) {
  std::string bytes(1, kSummaryFormat);
  std::uint16_t mask = 0;
  for (std::size_t i = 0; i < summary.size(); ++i)
    if (summary[i].rows > 0) mask = static_cast<std::uint16_t>(mask | 1U << i);
  append_raw(bytes, mask);
  for (const auto& figure : summary) {
    if (figure.rows == 0) continue;
    append_raw(bytes, figure.rows);
    append_raw(bytes, figure.trusted);
    for (const auto field : kSummaryFields) append_raw(bytes, figure.*field);
  }
  return bytes;
}

std::optional<Summary> decode_summary(std::string_view bytes) noexcept {
  if (bytes.size() < kSummaryHeader || bytes[0] != kSummaryFormat) return std::nullopt;
  std::uint16_t mask = 0;
  std::memcpy(&mask, bytes.data() + 1, sizeof mask);
  Summary summary{};
  const char* next = bytes.data() + kSummaryHeader;
  const char* const end = bytes.data() + bytes.size();
  const auto take = [&next](auto& value) {
    std::memcpy(&value, next, sizeof value);
    next += sizeof value;
  };
  for (std::size_t i = 0; i < summary.size(); ++i) {
    if ((mask >> i & 1U) == 0) continue;
    if (end - next < static_cast<std::ptrdiff_t>(kSummaryBytes)) return std::nullopt;
    take(summary[i].rows);
    take(summary[i].trusted);
    for (const auto field : kSummaryFields) take(summary[i].*field);
  }
  if (next != end || mask >> summary.size() != 0) return std::nullopt;
  return summary;
}

double std_of_mean(std::span<const double> batch_means, std::span<const double> weights) {
  const std::size_t n = batch_means.size();
  double mean = 0.0, weights2 = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    mean += weights[i] * batch_means[i];
    weights2 += square(weights[i]);
  }
  const double batches = weights2 > 0.0 ? 1.0 / weights2 : 0.0;
  if (batches < kLeastBatches) return FigureSummary::kUnknown;
  double variance = 0.0, neighbours = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    const double d = batch_means[i] - mean;
    variance += weights[i] * square(d);
    if (i > 0) neighbours += std::sqrt(weights[i] * weights[i - 1]) * d * (batch_means[i - 1] - mean);
  }
  if (!(variance > 0.0)) return 0.0;
  // Correlation of neighbours; what the subtracted mean takes from it is added again (Kendall 1954).
  const double seen = neighbours / variance;
  const double correlation = std::clamp(seen + (1 + 3 * seen) / batches, 0.0, 0.9);
  // So many batches say as much as one independent one.
  const double alike = std::min((1 + correlation) / (1 - correlation), batches / 3);
  // The mean follows batches that are alike: their variance about it is less than their variance.
  const double kept = std::max(1 - (alike - 1) / (batches - 1), 0.3);
  const double freedom = std::max((batches - 1) / alike, 2.0);
  return std::sqrt(variance / (1 - weights2) * alike / (batches * kept)) * student_over_normal(freedom);
}

void FigureGatherer::add(std::int64_t time_ns, const online::Figure& figure, bool trusted) {
  if (!std::isfinite(figure.value)) return;
  Rows& rows = trusted ? trusted_ : others_;
  rows.times_ns.push_back(time_ns);
  rows.values.push_back(figure.value);
  rows.stds.push_back(figure.std);
}

void FigureGatherer::clear() {
  for (Rows* rows : {&trusted_, &others_}) {
    rows->times_ns.clear();
    rows->values.clear();
    rows->stds.clear();
  }
}

FigureSummary FigureGatherer::summary(double memory_s) const {
  FigureSummary summary;
  summary.trusted = static_cast<std::uint32_t>(trusted_.values.size());
  summary.rows = summary.trusted + static_cast<std::uint32_t>(others_.values.size());
  if (summary.rows == 0) return summary;
  if (summary.trusted == 0) {
    describe(others_.values, summary);
    return summary;
  }
  describe(trusted_.values, summary);
  double squares = 0.0, known = 0.0;
  for (const double std : trusted_.stds) {
    if (!std::isfinite(std)) continue;
    squares += square(std);
    known += 1.0;
  }
  if (known > 0.0) {
    const double step_s = median_step_s(trusted_.times_ns);
    // Rows without a distance in time are one estimate.
    summary.own_std = trusted_.values.size() > 1 && step_s <= 0.0
                          ? std::sqrt(squares / known)
                          : std_by_memory(std::sqrt(squares / known), step_s > 0.0 ? memory_s / step_s : 0.0,
                                          static_cast<double>(trusted_.values.size()));
  }
  summary.std = larger_known(std_by_batches(trusted_.values), summary.own_std);
  return summary;
}

FigureSummary combine(std::span<const FigureSummary> stretches, double memory) {
  FigureSummary all;
  for (const auto& part : stretches) {
    all.rows += part.rows;
    all.trusted += part.trusted;
  }
  if (all.rows == 0) return all;
  const auto weight_of = [&](const FigureSummary& part) {
    return all.trusted > 0 ? static_cast<double>(part.trusted) / all.trusted
                           : static_cast<double>(part.rows) / all.rows;
  };
  std::vector<double> means, weights;
  double mean = 0.0, own = 0.0, each = 0.0, squares = 0.0;
  all.min = std::numeric_limits<double>::infinity();
  all.max = -all.min;
  for (const auto& part : stretches) {
    const double weight = weight_of(part);
    if (weight <= 0.0) continue;
    means.push_back(part.mean);
    weights.push_back(weight);
    mean += weight * part.mean;
    own += square(weight * part.own_std);
    each += square(weight * part.std);
    all.min = std::min(all.min, part.min);
    all.max = std::max(all.max, part.max);
  }
  for (const auto& part : stretches)
    if (const double weight = weight_of(part); weight > 0.0)
      squares += weight * (square(part.spread) + square(part.mean - mean));
  all.mean = mean;
  all.spread = std::sqrt(squares);
  if (all.trusted == 0) return all;
  const double alike = alike_by_memory(memory, static_cast<double>(means.size()));
  all.own_std = alike * std::sqrt(own);
  const double between = std_of_mean(means, weights);
  all.std = std::isnan(between) ? alike * std::sqrt(each) : larger_known(between, all.own_std);
  return all;
}

}  // namespace resonid::monitor
