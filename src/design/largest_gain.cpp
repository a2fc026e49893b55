// SPDX-License-Identifier: MIT
#include "design/largest_gain.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "design/closed_loop.hpp"
#include "design/pid.hpp"

namespace resonid::design {
namespace {

using Complex = std::complex<double>;

/// The smaller positive root of a x^2 + 2 b x + c, which is not negative at 0; infinite where there is none.
/// By the formula that does not subtract (docs/methods/tune.md 4.6).
double first_root(double a, double b, double c) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  const double discriminant = b * b - a * c;
  if (discriminant < 0.0) return kNever;
  const double s = -(b + std::copysign(std::sqrt(discriminant), b));
  const double one = a != 0.0 ? s / a : kNever, other = s != 0.0 ? c / s : kNever;
  double least = kNever;
  for (const double root : {one, other})
    if (root > 0.0) least = std::min(least, root);
  return least;
}

double product(const Complex& x, const Complex& y) { return x.real() * y.real() + x.imag() * y.imag(); }

/// The rows of all machines, and how far a pair of gains is from the bounds.
class GainSearch {
 public:
  GainSearch(const Machines& machines, std::span<const Biquad> biquads, const PidShape& shape,
             const Bounds& bounds)
      : machines_(machines), biquads_(biquads), shape_(shape), bounds_(bounds) {
    fill();
  }

  [[nodiscard]] std::optional<LargestGain> best_of(double from, double to, int gains) {
    LargestGain best{0.0, 0.0};
    // To and fro, since where a large one is known the others are quickly seen to be smaller. A prime, so
    // that all of them have their turn.
    constexpr int kStride = 37;
    for (int i = 1; i <= gains; ++i) {
      const double kp = from + (to - from) * (1 + i * kStride % gains) / gains;
      const double ki = rows_.largest_integral(kp, best.ki, recent_);
      if (ki > best.ki && std::isfinite(ki)) best = {kp, ki};
    }
    if (!(best.ki > 0.0)) return std::nullopt;
    return is_stable_there(best) ? best : best_stable_of(from, to, gains);
  }

  [[nodiscard]] double largest_proportional() const { return limit_; }

  /// Nine values of kp around the best, nearer and nearer.
  void zoom(LargestGain& best, double distance, int rounds) {
    for (int round = 0; round < rounds; ++round) {
      constexpr int kHalf = 4;
      const LargestGain centre = best;
      for (int i = -kHalf; i <= kHalf; ++i) {
        const double kp = centre.kp + distance * i / (kHalf + 1.0);
        if (i == 0 || !(kp > 0.0)) continue;
        const double ki = rows_.largest_integral(kp, best.ki, recent_);
        if (ki > best.ki && std::isfinite(ki) && is_stable_there({kp, ki})) best = {kp, ki};
      }
      distance /= kHalf + 1.0;
    }
  }

  /// Adds the frequencies between lines at which a bound is nearly reached. By how much one is exceeded.
  double exchange(Machines& machines, const LargestGain& gains) {
    constexpr double kNearly = 0.9;
    double worst = 0.0;
    for (std::size_t m = 0; m < machines.all.size(); ++m) {
      const Machine& machine = machines.all[m];
      const LoopFunctions loop(machine.response(), controller_of(gains.kp, gains.ki, machine.sample_time_s()),
                               machine.known_to_hz());
      std::vector<double> added;
      for (const auto& peak : loop.peaks(machines.lines[m].frequencies_hz(), bounds_, kNearly)) {
        worst = std::max(worst, peak.value / peak.bound - 1.0);
        added.push_back(peak.frequency_hz);
      }
      machines.lines[m].add(machine, added);
    }
    fill();
    return worst;
  }

  /// At half the integral gain: inside an interval of gains that meet the bounds no pole crosses the circle
  /// (docs/methods/tune.md 4.3).
  [[nodiscard]] bool is_stable(const LargestGain& gains) const {
    return std::all_of(machines_.all.begin(), machines_.all.end(), [&](const Machine& machine) {
      const auto controller = controller_of(gains.kp, 0.5 * gains.ki, machine.sample_time_s());
      return closed_loop(machine.states(), controller.states()).is_stable();
    });
  }

 private:
  [[nodiscard]] LinearController controller_of(double kp, double ki, double sample_time_s) const {
    if (shape_.time_s > 0.0)
      return LinearController(
          Pid{kp, ki, kp * shape_.time_s, shape_.filter_s}.transfer_function(sample_time_s));
    return {FilteredPi{kp, ki, {biquads_.begin(), biquads_.end()}}, sample_time_s};
  }

  /// Where the largest of all is not stable.
  [[nodiscard]] std::optional<LargestGain> best_stable_of(double from, double to, int gains) {
    std::vector<LargestGain> found;
    for (int i = 1; i <= gains; ++i) {
      const double kp = from + (to - from) * i / gains;
      if (const double ki = rows_.largest_integral(kp); ki > 0.0 && std::isfinite(ki))
        found.push_back({kp, ki});
    }
    std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.ki > b.ki; });
    for (const auto& one : found)
      if (is_stable_there(one)) return one;
    return std::nullopt;
  }

  /// Up to the largest proportional gain all intervals begin at ki = 0 side by side: there one look decides
  /// for every kp.
  [[nodiscard]] bool is_stable_there(const LargestGain& gains) {
    if (gains.kp > limit_) return is_stable(gains);
    if (!stable_below_limit_) stable_below_limit_ = is_stable(gains);
    return *stable_below_limit_;
  }

  void fill() {
    rows_ = {};
    std::vector<Biquad::Coefficients> filters;
    for (std::size_t m = 0; m < machines_.all.size(); ++m) {
      filters.clear();
      for (const Biquad& biquad : biquads_)
        filters.push_back(biquad.coefficients(machines_.all[m].sample_time_s()));
      for (const auto& line : machines_.lines[m].lines()) {
        std::complex<double> filter = 1.0;
        for (const auto& one : filters) filter *= one.at(line.inverse_z);
        rows_.add(line, filter, bounds_,
                  shape_.time_s > 0.0 ? shape_.at(line.inverse_z, machines_.all[m].sample_time_s()) : 1.0);
      }
    }
    recent_ = {};
    limit_ = rows_.largest_proportional();
    stable_below_limit_.reset();
  }

  const Machines& machines_;
  std::span<const Biquad> biquads_;
  PidShape shape_;
  const Bounds& bounds_;
  QuadraticRows rows_;
  QuadraticRows::Recent recent_;
  double limit_ = 0.0;
  std::optional<bool> stable_below_limit_;
};

}  // namespace

Complex PidShape::at(Complex inverse_z, double sample_time_s) const {
  const double p = filter_s > 0.0 ? std::exp(-sample_time_s / filter_s) : 0.0;
  return 1.0 + time_s * (1.0 - p) / sample_time_s * (1.0 - inverse_z) / (1.0 - p * inverse_z);
}

void QuadraticRows::add(const MachineLines::Line& line, const Complex& filter, const Bounds& bounds,
                        const Complex& proportional) {
  const Complex one(1.0), none(0.0);
  const auto pi = [&](const Complex& x) { return std::array{none, x * proportional, x * line.integrator}; };
  const Complex measured = filter * line.plant.measured;
  const std::array loop = {one, measured * proportional, measured * line.integrator};
  if (bounds.sensitivity) add(loop, {one, none, none}, *bounds.sensitivity);
  if (bounds.complementary) add(loop, pi(measured), *bounds.complementary);
  if (bounds.load_transfer) add(loop, pi(filter * line.plant.load), *bounds.load_transfer);
  if (bounds.controller_sensitivity) add(loop, pi(filter), *bounds.controller_sensitivity);
  if (bounds.disk) add(loop, {one, -loop[1], -loop[2]}, *bounds.disk);
  if (bounds.beyond_band && line.beyond > 0.0)
    add({one, none, none}, pi(line.beyond * measured), *bounds.beyond_band);
}

void QuadraticRows::add(const std::array<Complex, 3>& loop, const std::array<Complex, 3>& bounded,
                        double bound) {
  const auto entry = [&](std::size_t i, std::size_t j) {
    return bound * bound * product(loop[i], loop[j]) - product(bounded[i], bounded[j]);
  };
  q00_.push_back(entry(0, 0));
  q01_.push_back(entry(0, 1));
  q02_.push_back(entry(0, 2));
  q11_.push_back(entry(1, 1));
  q12_.push_back(entry(1, 2));
  q22_.push_back(entry(2, 2));
}

double QuadraticRows::largest_proportional() const {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < size(); ++i) {
    if (q00_[i] < 0.0) return 0.0;
    least = std::min(least, first_root(q11_[i], q01_[i], q00_[i]));
  }
  return least;
}

double QuadraticRows::largest_integral(double kp) const {
  Recent none;
  return largest_integral(kp, -1.0, none);
}

double QuadraticRows::largest_integral(double kp, double wanted, Recent& recent) const {
  double least = std::numeric_limits<double>::infinity();
  std::size_t limiting = size();
  const auto meets = [&](std::size_t i) {
    const double c = q00_[i] + kp * (2.0 * q01_[i] + kp * q11_[i]);
    if (c < 0.0) return false;
    const double b = q02_[i] + kp * q12_[i], a = q22_[i];
    // Most rows are met up to the least root so far: at it, and with no valley before it.
    const bool valley = a > 0.0 && b < 0.0 && b * b > a * c && -b < a * least;
    if (valley || !(least < std::numeric_limits<double>::infinity()) ||
        c + least * (2.0 * b + least * a) < 0.0) {
      if (const double root = first_root(a, b, c); root < least) {
        least = root;
        limiting = i;
      }
    }
    return least > wanted;
  };
  for (const std::size_t i : recent.rows)
    if (i < size() && !meets(i)) return std::min(least, wanted);
  bool met = true;
  for (std::size_t i = 0; i < size() && met; ++i) met = meets(i);
  if (limiting < size()) recent.rows[recent.next++ % recent.rows.size()] = limiting;
  return met ? least : -1.0;
}

Machines::Machines(std::vector<Machine> machines, double share) : all(std::move(machines)) {
  for (const Machine& machine : all) lines.emplace_back(machine, share);
}

void Machines::add(Machine machine, double share) {
  all.push_back(std::move(machine));
  lines.emplace_back(all.back(), share);
}

namespace {

std::optional<LargestGain> rough_gain(const Machines& machines, std::span<const Biquad> biquads,
                                      const PidShape& shape, const Bounds& bounds) {
  constexpr int kGains = 40, kZooms = 4;
  GainSearch search(machines, biquads, shape, bounds);
  const double limit = search.largest_proportional();
  if (!std::isfinite(limit)) return std::nullopt;
  auto best = search.best_of(0.0, limit, kGains);
  if (best) search.zoom(*best, limit / kGains, kZooms);
  return best;
}

/// By what a bound may be exceeded between lines, relative.
constexpr double kMetBetweenLines = 1e-9;

std::optional<LargestGain> exact_gain(Machines& machines, std::span<const Biquad> biquads,
                                      const PidShape& shape, const Bounds& bounds, const Accuracy& accuracy) {
  GainSearch search(machines, biquads, shape, bounds);
  const double limit = search.largest_proportional();
  if (!std::isfinite(limit)) return std::nullopt;
  auto best = search.best_of(0.0, limit, accuracy.gains);
  if (!best) return std::nullopt;
  const double distance = limit / accuracy.gains;
  search.zoom(*best, distance, accuracy.zooms);
  for (int round = 0; round < accuracy.exchanges; ++round) {
    best->exceeded = search.exchange(machines, *best);
    if (best->exceeded <= kMetBetweenLines) break;
    // The new lines take something off everywhere near the best.
    auto again = search.best_of(std::max(0.0, best->kp - distance), best->kp + distance, 20);
    if (!again) again = search.best_of(0.0, search.largest_proportional(), accuracy.gains);
    if (!again) return std::nullopt;
    search.zoom(*again, 0.1 * distance, accuracy.zooms);
    best = again;
  }
  return search.is_stable(*best) ? best : std::nullopt;
}

}  // namespace

std::optional<LargestGain> rough_integral_gain(const Machines& machines, std::span<const Biquad> biquads,
                                               const Bounds& bounds) {
  return rough_gain(machines, biquads, {}, bounds);
}

std::optional<LargestGain> rough_pid_gain(const Machines& machines, const PidShape& shape,
                                          const Bounds& bounds) {
  return rough_gain(machines, {}, shape, bounds);
}

std::optional<LargestGain> largest_integral_gain(Machines& machines, std::span<const Biquad> biquads,
                                                 const Bounds& bounds, const Accuracy& accuracy) {
  return exact_gain(machines, biquads, {}, bounds, accuracy);
}

std::optional<LargestGain> largest_pid_gain(Machines& machines, const PidShape& shape, const Bounds& bounds,
                                            const Accuracy& accuracy) {
  return exact_gain(machines, {}, shape, bounds, accuracy);
}

std::optional<LargestGain> largest_proportional_gain(Machines& machines, const Bounds& bounds,
                                                     const Accuracy& accuracy) {
  GainSearch search(machines, {}, {}, bounds);
  LargestGain best{search.largest_proportional(), 0.0};
  // What a smaller gain exceeds between lines may be met again at the largest: they are looked at once.
  constexpr int kSmaller = 16;
  bool looked_below = accuracy.exchanges == 0;
  for (int round = 0; best.kp > 0.0 && std::isfinite(best.kp) && round < accuracy.exchanges; ++round) {
    best.exceeded = search.exchange(machines, best);
    if (best.exceeded <= kMetBetweenLines && looked_below) break;
    if (best.exceeded <= kMetBetweenLines) {
      for (int i = 1; i < kSmaller; ++i) search.exchange(machines, {best.kp * i / kSmaller, 0.0});
      looked_below = true;
    }
    best.kp = search.largest_proportional();
  }
  if (!(best.kp > 0.0) || !std::isfinite(best.kp) || !search.is_stable(best)) return std::nullopt;
  return best;
}

}  // namespace resonid::design
