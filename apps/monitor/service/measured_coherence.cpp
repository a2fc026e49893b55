// SPDX-License-Identifier: MIT
#include "monitor/service/measured_coherence.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <limits>
#include <resonid/response/welch.hpp>

namespace resonid::monitor {
namespace {

constexpr std::size_t kCoherenceSegments = 32, kLeastSegments = 8;
constexpr std::size_t kFewFrequencies = 64;
constexpr std::chrono::seconds kCoherencePause{1};

/// Consecutive samples in which nothing is missing.
struct Stretch {
  std::vector<double> excitation, output;

  [[nodiscard]] std::size_t samples() const noexcept { return output.size(); }
};

/// Those among the newest samples of a ring, the oldest first.
std::vector<Stretch> newest_stretches(const Ring& ring, bool has_excitation, std::uint64_t samples) {
  const std::size_t width = ring.channels(), output = has_excitation ? 2 : 1;
  std::vector<Stretch> stretches(1);
  std::vector<double> values;
  const std::uint64_t end = ring.end();
  std::uint64_t at = std::max(ring.begin(), end - std::min(end, samples)), next = 0;
  while (at < end) {
    const auto piece = ring.copy(at, std::min<std::uint64_t>(4096, end - at), values);
    if (piece.samples == 0) {  // overwritten meanwhile
      at = std::max(at + 1, ring.begin());
      continue;
    }
    if (piece.first_sample != next) stretches.emplace_back();
    for (std::size_t k = 0; k < piece.samples; ++k) {
      const double x = piece.values[k * width], y = piece.values[k * width + output];
      if (std::isfinite(x) && std::isfinite(y)) {
        stretches.back().excitation.push_back(x);
        stretches.back().output.push_back(y);
      } else if (stretches.back().samples() > 0) {
        stretches.emplace_back();
      }
    }
    next = piece.first_sample + piece.samples;
    at = piece.position + piece.samples;
  }
  return stretches;
}

/// What rests has only rounding errors beside its mean, which are alike in every segment and hence coherent.
bool moves(const std::vector<double>& x) {
  const auto [low, high] = std::minmax_element(x.begin(), x.end());
  return *low < *high;
}

/// Sums of the spectra |X|^2, |Y|^2 and Y X* over stretches, per bin.
class CoherenceSums {
 public:
  CoherenceSums(const monitoring::AxisSpec& spec, std::size_t segment)
      : spec_(spec),
        segment_(segment),
        bins_(segment / 2 + 1),
        spacing_hz_(spec.sample_rate_hz / static_cast<double>(segment)) {}

  /// The newest samples of a stretch, for at most so many segments. Returns for how many.
  std::size_t add(const Stretch& stretch, std::size_t most) {
    const std::size_t hop = segment_ / 2;
    // A position counts as its differences, one fewer.
    const std::size_t fewer = spec_.output_quantity == data::OutputQuantity::position ? 1 : 0;
    if (stretch.samples() < segment_ + hop + fewer) return 0;
    const std::size_t segments = std::min(most, 1 + (stretch.samples() - fewer - segment_) / hop);
    const auto used = static_cast<std::ptrdiff_t>(segment_ + (segments - 1) * hop + fewer);
    data::Record record;
    record.sample_rate_hz = spec_.sample_rate_hz;
    record.output_quantity = spec_.output_quantity;
    record.input.samples.assign(stretch.excitation.end() - used, stretch.excitation.end());
    record.output.samples.assign(stretch.output.end() - used, stretch.output.end());
    if (!moves(record.input.samples) || !moves(record.output.samples)) return 0;
    response::WelchConfig config;
    config.segment_samples = segment_;
    const auto estimates = response::welch_lines(record, config, Approach::direct);
    if (!estimates || estimates->lines.empty()) return 0;
    const double averages = estimates->lines.front().degrees_of_freedom + 1.0;
    averages_ += averages;
    for (const auto& line : estimates->lines) {
      // The lines are referred to the input: X = sqrt(S_xx), Y = S_yx/sqrt(S_xx), and the covariance has the
      // part of S_yy that X does not explain.
      auto& bin = bins_.at(static_cast<std::size_t>(std::lround(line.frequency_hz / spacing_hz_)));
      bin.xx += averages * std::norm(line.input);
      bin.yx += averages * line.output * std::conj(line.input);
      bin.yy += averages *
                (std::norm(line.output) + std::max(0.0, line.covariance(2, 2).real()) * (averages - 1.0));
    }
    return segments;
  }
  [[nodiscard]] CoherenceSpectrum spectrum() const {
    CoherenceSpectrum out{spacing_hz_, averages_, {}};
    if (averages_ == 0.0) return out;
    out.value.assign(bins_.size(), std::numeric_limits<double>::quiet_NaN());
    for (std::size_t b = 1; b < bins_.size(); ++b)
      if (const double power = bins_[b].xx * bins_[b].yy; power > 0.0)
        out.value[b] = std::min(1.0, std::norm(bins_[b].yx) / power);
    return out;
  }

 private:
  struct Bin {
    double xx = 0.0, yy = 0.0;
    std::complex<double> yx;
  };
  const monitoring::AxisSpec& spec_;
  std::size_t segment_;
  std::vector<Bin> bins_;
  double spacing_hz_, averages_ = 0.0;
};

}  // namespace

std::size_t coherence_segment(const std::vector<double>& frequency_hz, double sample_rate_hz) {
  constexpr double kShortest = 256.0, kLongest = 8192.0;
  if (frequency_hz.empty()) return static_cast<std::size_t>(kShortest);
  double spacing_hz = frequency_hz.front();
  if (frequency_hz.size() <= kFewFrequencies)
    for (std::size_t i = 1; i < frequency_hz.size(); ++i)
      spacing_hz = std::min(spacing_hz, frequency_hz[i] - frequency_hz[i - 1]);
  const double samples = spacing_hz > 0.0 ? sample_rate_hz / spacing_hz : kLongest;
  return std::bit_ceil(static_cast<std::size_t>(std::clamp(samples, kShortest, kLongest)));
}

CoherenceSpectrum measured_coherence(const Ring& ring, const monitoring::AxisSpec& spec,
                                     std::size_t segment_samples) {
  // About twice as many as 32 segments take: some are lost to gaps.
  const auto stretches =
      newest_stretches(ring, spec.has_excitation, (kCoherenceSegments + 1) * segment_samples);
  CoherenceSums sums(spec, segment_samples);
  std::size_t segments = 0;
  for (auto stretch = stretches.rbegin(); stretch != stretches.rend(); ++stretch)
    if (kCoherenceSegments - segments >= 2) segments += sums.add(*stretch, kCoherenceSegments - segments);
  if (segments < kLeastSegments) return {};
  return sums.spectrum();
}

CoherenceColumns coherence_at(const CoherenceSpectrum& spectrum, const std::vector<double>& frequency_hz) {
  CoherenceColumns columns;
  if (spectrum.value.size() < 2) return columns;
  const auto last = static_cast<double>(spectrum.value.size() - 1);
  for (const double hz : frequency_hz) {
    const double bin = std::clamp(std::round(hz / spectrum.spacing_hz), 1.0, last);
    const double value = spectrum.value[static_cast<std::size_t>(bin)];
    columns.value.push_back(value);
    columns.std.push_back(std::sqrt(2.0 * value / spectrum.averages) * (1.0 - value));
  }
  if (std::none_of(columns.value.begin(), columns.value.end(), [](double x) { return std::isfinite(x); }))
    return {};
  return columns;
}

CoherenceColumns MeasuredCoherence::at(const Ring& ring, const monitoring::AxisSpec& spec,
                                       const std::vector<double>& frequency_hz) {
  const std::scoped_lock lock(mutex_);
  const std::size_t segment = coherence_segment(frequency_hz, spec.sample_rate_hz);
  const auto now = std::chrono::steady_clock::now();
  const std::uint64_t end = ring.end();
  const bool due = !end_ || (end != *end_ && now - made_ >= kCoherencePause);
  if (due || segment != segment_) {
    spectrum_ = measured_coherence(ring, spec, segment);
    segment_ = segment;
    end_ = end;
    made_ = now;
  }
  return coherence_at(spectrum_, frequency_hz);
}

}  // namespace resonid::monitor
