// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/polynomial.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/diagnostics/gap.hpp>
#include <span>

namespace resonid::diagnostics {
namespace {

using Complex = std::complex<double>;

/// Numerator and denominator of both plants on the unit circle: finite where a plant is not.
class Pair {
 public:
  Pair(const data::TransferFunction& first, const data::TransferFunction& second)
      : first_(first), second_(second) {}

  struct Point {
    double angle = 0.0;
    double distance = 0.0;
    Complex f;  // b2* b1 + a2* a1
  };
  [[nodiscard]] Point at(double angle) const {
    const Complex w = std::polar(1.0, -angle);
    const Complex b1 = polynomial(first_.numerator, w), a1 = polynomial(first_.denominator, w);
    const Complex b2 = polynomial(second_.numerator, w), a2 = polynomial(second_.denominator, w);
    const double size = std::hypot(std::abs(a1), std::abs(b1)) * std::hypot(std::abs(a2), std::abs(b2));
    if (size == 0.0) return {angle, 0.0, 1.0};  // both sides of a plant vanish: a factor to be cancelled
    return {angle, std::min(1.0, std::abs(b1 * a2 - b2 * a1) / size),
            (std::conj(b2) * b1 + std::conj(a2) * a1) / size};
  }

 private:
  const data::TransferFunction& first_;
  const data::TransferFunction& second_;
};

/// Angles where a pole or zero turns the response, each with a neighbourhood as narrow as its distance from
/// the circle.
void add_turns(const std::vector<double>& coefficients, std::vector<double>& angles) {
  auto first = std::find_if(coefficients.begin(), coefficients.end(), [](double c) { return c != 0.0; });
  const data::TransferFunction roots{{1.0}, {first, coefficients.end()}, 1.0};
  for (const Complex& root : roots.poles()) {
    const double centre = std::abs(std::arg(root));
    const double width = std::max(std::abs(1.0 - std::abs(root)), 1e-9);
    angles.push_back(centre);
    for (double away = 0.05 * width; away < kPi; away *= 1.3) {
      angles.push_back(centre + away);
      angles.push_back(centre - away);
    }
  }
}

std::vector<double> grid_of(const data::TransferFunction& first, const data::TransferFunction& second) {
  std::vector<double> angles;
  constexpr int kEven = 256;
  for (int i = 1; i < kEven; ++i) angles.push_back(kPi * i / kEven);
  for (double angle = 1e-8; angle < kPi; angle *= 1.1) angles.push_back(angle);
  for (const auto* side : {&first, &second}) {
    add_turns(side->numerator, angles);
    add_turns(side->denominator, angles);
  }
  std::erase_if(angles, [](double a) { return !(a > 0.0) || !(a < kPi); });
  angles.push_back(0.0);
  angles.push_back(kPi);
  std::sort(angles.begin(), angles.end());
  angles.erase(std::unique(angles.begin(), angles.end()), angles.end());
  return angles;
}

/// Change of arg F from one point to the next, refined until it is beyond doubt. Not a number where F passes
/// through zero.
double turned(const Pair& pair, const Pair::Point& from, const Pair::Point& to, int depth) {
  constexpr double kSure = 0.5;
  const double small = std::min(std::abs(from.f), std::abs(to.f));
  if (small > 0.0 && std::abs(to.f - from.f) < kSure * small) return std::arg(to.f / from.f);
  if (depth == 0) return std::nan("");
  const auto middle = pair.at(0.5 * (from.angle + to.angle));
  return turned(pair, from, middle, depth - 1) + turned(pair, middle, to, depth - 1);
}

/// Highest distance near a grid point, by golden section between its neighbours.
Pair::Point refined(const Pair& pair, double low, double high, Pair::Point best) {
  constexpr double kGolden = 0.6180339887498949;
  for (int i = 0; i < 60 && high - low > 1e-12; ++i) {
    const auto left = pair.at(high - kGolden * (high - low));
    const auto right = pair.at(low + kGolden * (high - low));
    const auto& better = left.distance > right.distance ? left : right;
    if (better.distance > best.distance) best = better;
    (left.distance > right.distance ? high : low) = left.distance > right.distance ? right.angle : left.angle;
  }
  return best;
}

}  // namespace

double chordal_distance(Complex first, Complex second) {
  // Two divisions, not one by a product: large responses must not overflow.
  return std::abs(first - second) / std::hypot(1.0, std::abs(first)) / std::hypot(1.0, std::abs(second));
}

data::Estimate chordal_distance(Complex first, double first_std, Complex second, double second_std) {
  // d|G1-G2| lies along the difference; dk/d|G1| along G1. Both parts of the gradient are real vectors in the
  // plane, and each component of the error has half the variance.
  const double k = chordal_distance(first, second);
  const Complex apart = first - second;
  if (k == 0.0) return {0.0, std::hypot(first_std, second_std) / (1.0 + std::norm(first)) * std::sqrt(0.5)};
  const Complex along = apart / std::norm(apart);
  const Complex by_first = k * (along - first / (1.0 + std::norm(first)));
  const Complex by_second = k * (-along - second / (1.0 + std::norm(second)));
  return {k, std::hypot(std::abs(by_first) * first_std, std::abs(by_second) * second_std) * std::sqrt(0.5)};
}

std::size_t GapCurve::largest() const {
  if (distance.empty()) return 0;
  return static_cast<std::size_t>(std::max_element(distance.begin(), distance.end()) - distance.begin());
}

double GapCurve::excess(std::size_t line) const {
  if (line >= noise.size()) return 0.0;
  constexpr std::size_t kAside = 4;
  const std::size_t from = line < kAside ? 0 : line - kAside;
  const std::size_t to = std::min(line + kAside + 1, noise.size());
  std::array<double, 2 * kAside + 1> around{};
  std::copy(noise.begin() + static_cast<std::ptrdiff_t>(from),
            noise.begin() + static_cast<std::ptrdiff_t>(to), around.begin());
  const double floor = std::max(noise[line], median_in_place(std::span(around).first(to - from)));
  return floor > 0.0 ? distance[line] / floor : 0.0;
}

std::size_t GapCurve::most_excessive() const {
  std::size_t most = 0;
  for (std::size_t i = 1; i < noise.size(); ++i)
    if (excess(i) > excess(most)) most = i;
  return most;
}

double GapCurve::chance() const {
  if (noise.empty()) return 1.0;
  // |difference|^2 over its mean is exponential for circular errors.
  const double single = std::exp(-std::pow(excess(most_excessive()), 2));
  return -std::expm1(static_cast<double>(noise.size()) * std::log1p(-std::min(single, 1.0 - 1e-16)));
}

GapCurve gap_curve(const data::FrequencyResponse& first, const data::FrequencyResponse& second,
                   const Weight& weight) {
  GapCurve curve;
  if (first.lines() == 0 || second.lines() == 0) return curve;
  const double low = std::max(first.frequency_hz.front(), second.frequency_hz.front());
  const double high = std::min(first.frequency_hz.back(), second.frequency_hz.back());
  const auto common = first.band(low, high), other = second.band(low, high);
  const auto& grid = common.lines() <= other.lines() ? common.frequency_hz : other.frequency_hz;
  const bool known = !first.std.empty() && !second.std.empty();
  const auto spread = [](const data::FrequencyResponse& g) {
    data::FrequencyResponse s{g.frequency_hz, {}, {}, {}, {}};
    for (const double sd : g.std) s.value.emplace_back(sd, 0.0);
    return s;
  };
  const auto first_spread = spread(first), second_spread = spread(second);
  for (const double f : grid) {
    const Complex w = weight ? weight(f) : 1.0;
    const Complex a = w * first.at(f), b = w * second.at(f);
    if (!std::isfinite(std::abs(a)) || !std::isfinite(std::abs(b))) continue;
    curve.frequency_hz.push_back(f);
    if (!known) {
      curve.distance.push_back(chordal_distance(a, b));
      continue;
    }
    const double a_std = std::abs(w) * first_spread.at(f).real(),
                 b_std = std::abs(w) * second_spread.at(f).real();
    const auto k = chordal_distance(a, a_std, b, b_std);
    curve.distance.push_back(k.value);
    curve.std.push_back(k.std);
    curve.noise.push_back(std::hypot(a_std, b_std) / std::hypot(1.0, std::abs(a)) /
                          std::hypot(1.0, std::abs(b)));
  }
  return curve;
}

expected<NuGap, Error> nu_gap(const data::TransferFunction& first, const data::TransferFunction& second) {
  for (const auto* side : {&first, &second}) {
    if (side->numerator.empty()) return refuse("numerator", "must not be empty");
    if (side->denominator.empty() || side->denominator[0] == 0.0)
      return refuse("denominator", "must begin with a coefficient other than 0");
  }
  if (!(first.sample_time_s > 0.0)) return refuse("sample_time_s", "must be > 0", first.sample_time_s);
  if (std::abs(first.sample_time_s - second.sample_time_s) > 1e-9 * first.sample_time_s)
    return refuse("sample_time_s", "must be the same for both", second.sample_time_s);
  const Pair pair(first, second);
  std::vector<Pair::Point> points;
  for (const double angle : grid_of(first, second)) points.push_back(pair.at(angle));
  std::size_t top = 0;
  double turn = 0.0;
  constexpr int kDepth = 48;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i].distance > points[top].distance) top = i;
    if (i > 0) turn += turned(pair, points[i - 1], points[i], kDepth);
  }
  const auto best = refined(pair, points[top > 0 ? top - 1 : 0].angle,
                            points[std::min(top + 1, points.size() - 1)].angle, points[top]);
  NuGap result;
  result.largest_distance = best.distance;
  result.frequency_hz = best.angle / (kTwoPi * first.sample_time_s);
  // Real coefficients: F(0) and F(pi) are real, and half the circle turns by a whole number of half turns.
  result.condition_holds = std::abs(turn) < 1.0;
  result.gap = result.condition_holds ? best.distance : 1.0;
  return result;
}

data::TransferFunction weighted(const data::TransferFunction& weight, const data::TransferFunction& plant) {
  const auto product = [](const std::vector<double>& a, const std::vector<double>& b) {
    std::vector<double> c(a.empty() || b.empty() ? 0 : a.size() + b.size() - 1, 0.0);
    for (std::size_t i = 0; i < a.size(); ++i)
      for (std::size_t j = 0; j < b.size(); ++j) c[i + j] += a[i] * b[j];
    return c;
  };
  return {product(weight.numerator, plant.numerator), product(weight.denominator, plant.denominator),
          plant.sample_time_s};
}

}  // namespace resonid::diagnostics
