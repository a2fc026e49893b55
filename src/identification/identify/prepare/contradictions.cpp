// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/prepare/contradictions.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/response/detail/excitation_lines.hpp>
#include <span>
#include <utility>

#include "linalg/decompositions.hpp"

namespace resonid::identification::detail {
namespace {

double least_share(const data::Record& record) {
  return record.excitation.present() ? kCriteria.told_excitation : kCriteria.told_of_input;
}
const std::string& exciting_name(const data::Record& record) {
  return record.excitation.present() ? record.excitation.name : record.input.name;
}

std::string text_of(const online::SweepLaw& law) {
  return fmt::format("a chirp from {:.4g} to {:.4g} Hz in {:.4g} s", law.from_hz, law.to_hz, law.duration_s);
}

double frequency(const online::SweepLaw& law, double time_s) {
  constexpr double kStep = 1e-4;  // of the duration
  const double step = kStep * law.duration_s;
  return (law.cycles(time_s + step) - law.cycles(time_s)) / step;
}

bool same_law(const online::SweepLaw& a, const online::SweepLaw& b) {
  const double common = std::min(a.duration_s, b.duration_s);
  const double span = std::max(std::abs(a.to_hz - a.from_hz), std::abs(b.to_hz - b.from_hz));
  constexpr double kParts[] = {0.1, 0.5, 0.9};
  return std::all_of(std::begin(kParts), std::end(kParts), [&](double part) {
    return std::abs(frequency(a, part * common) - frequency(b, part * common)) < kCriteria.same_sweep * span;
  });
}

/// Share of the variance that cosine and sine along the law explain, block by block about a straight line.
double share_along(std::span<const double> x, double rate_hz, const online::SweepLaw& law) {
  constexpr std::size_t kBlocks = 32;
  const auto length = std::min(x.size(), static_cast<std::size_t>(law.duration_s * rate_hz));
  const std::size_t block = length / kBlocks;
  if (block < 12) return 1.0;  // too short to tell
  double explained = 0.0, all = 0.0;
  for (std::size_t b = 0; b < kBlocks; ++b) {
    Eigen::Matrix4d gram = Eigen::Matrix4d::Zero();
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    double square = 0.0;
    for (std::size_t i = 0; i < block; ++i) {
      const std::size_t k = b * block + i;
      const double phase = kTwoPi * law.cycles(static_cast<double>(k) / rate_hz);
      const Eigen::Vector4d row(1.0, 2.0 * static_cast<double>(i) / static_cast<double>(block) - 1.0,
                                std::cos(phase), std::sin(phase));
      const double value = x[k] - x[b * block];
      gram += row * row.transpose();
      right += value * row;
      square += value * value;
    }
    const auto rest = [&](Eigen::Index columns) {
      const Eigen::MatrixXd used = gram.topLeftCorner(columns, columns);
      const Eigen::VectorXd fitted = linalg::PivotedQr(used).solve(right.head(columns));
      return std::max(0.0, square - fitted.dot(right.head(columns)));
    };
    const double about_line = rest(2);
    all += about_line;
    explained += about_line - rest(4);
  }
  return all > 0.0 ? explained / all : 0.0;
}

std::optional<Error> against_chirp(const data::Record& record, const online::SweepLaw& told) {
  if (const auto shown = response::detect_chirp(record)) {
    if (same_law(told, *shown)) return std::nullopt;
    return Error{"chirp", fmt::format("contradicts the recording: {} is {}; leave .chirp out, or correct it",
                                      exciting_name(record), text_of(*shown))};
  }
  const double share = share_along(data::exciting(record), record.sample_rate_hz, told);
  if (share >= least_share(record)) return std::nullopt;
  // In a noisy loop a chirp may be a small part of the input, and yet more than the same chirp backwards.
  online::SweepLaw backwards = told;
  std::swap(backwards.from_hz, backwards.to_hz);
  const double by_chance = share_along(data::exciting(record), record.sample_rate_hz, backwards);
  if (!record.excitation.present() && share > kCriteria.more_than_chance * by_chance) return std::nullopt;
  return Error{
      "chirp",
      fmt::format("contradicts the recording: {} holds hardly anything ({:.0f} %) of {} that begins with "
                  "the first sample; leave .chirp out, or say where it begins (.from_s)",
                  exciting_name(record), 100.0 * share, text_of(told))};
}

std::optional<Error> against_period(const data::Record& record, std::size_t told) {
  if (const auto shown = response::detect_period(record)) {
    const auto periods = std::round(static_cast<double>(told) / static_cast<double>(*shown));
    if (periods >= 1.0 && std::abs(static_cast<double>(told) - periods * static_cast<double>(*shown)) <= 1.0)
      return std::nullopt;
    return Error{
        "period_samples",
        fmt::format("is {}, but {} repeats every {} samples; leave .period_samples out, or correct it", told,
                    exciting_name(record), *shown)};
  }
  if (!record.excitation.present()) return std::nullopt;  // noise of the loop hides a period from the input
  const auto& x = record.excitation.samples;
  if (x.size() < told + told / 2) return std::nullopt;
  double both = 0.0, first = 0.0, second = 0.0;
  const double middle = mean(x);
  for (std::size_t k = 0; k + told < x.size(); ++k) {
    const double a = x[k] - middle, b = x[k + told] - middle;
    both += a * b, first += a * a, second += b * b;
  }
  const double correlation = both / std::max(std::sqrt(first * second), 1e-300);
  if (correlation >= least_share(record)) return std::nullopt;
  return Error{"period_samples",
               fmt::format("is {}, but {} does not repeat after so many samples (correlation {:.2f}); leave "
                           ".period_samples out, or correct it",
                           told, exciting_name(record), correlation)};
}

}  // namespace

std::optional<Error> contradiction(const data::Record& record, const Options& options) {
  if (options.chirp) return against_chirp(record, *options.chirp);
  if (options.period_samples > 0) return against_period(record, options.period_samples);
  return std::nullopt;
}

std::optional<Error> constant_input(const data::Record& record) {
  const auto& u = record.input.samples;
  if (u.empty() || record.excitation.present()) return std::nullopt;
  const auto [low, high] = std::minmax_element(u.begin(), u.end());
  if (*low < *high) return std::nullopt;
  return Error{"input",
               fmt::format("{} is constant ({:g}): nothing excites the machine, or the torque stands in "
                           "another column (.input)",
                           record.input.name, *low)};
}

std::optional<Error> copied_input(const data::Record& record) {
  const auto& u = record.input.samples;
  const auto& y = record.output.samples;
  if (u.size() != y.size() || u.size() < kCriteria.fewest_samples) return std::nullopt;
  const double mu = mean(u), my = mean(y);
  double uu = 0.0, uy = 0.0, yy = 0.0;
  for (std::size_t k = 0; k < u.size(); ++k) {
    const double a = u[k] - mu, b = y[k] - my;
    uu += a * a, uy += a * b, yy += b * b;
  }
  if (!(uu > 0.0) || !(yy > 0.0) || uy * uy < (1.0 - kCriteria.copied) * uu * yy) return std::nullopt;
  const double factor = uy / uu;
  return Error{
      "output",
      fmt::format("{} is {:.4g} times {}{}, sample by sample: it is the same signal, no answer to it. Name "
                  "the column of the measured motion with .output{}",
                  record.output.name, factor, record.input.name,
                  std::abs(my - factor * mu) > 1e-6 * std::sqrt(yy) ? " and a constant" : "",
                  factor < 0.0
                      ? "; or a proportional controller only answers the noise of the output: excite "
                        "the machine"
                      : "")};
}

}  // namespace resonid::identification::detail
