// SPDX-License-Identifier: MIT
#include "design/response_disks.hpp"

#include <algorithm>
#include <cmath>
#include <data/pole_at_one.hpp>
#include <functional>
#include <resonid/base/constants.hpp>

#include "design/between_lines.hpp"
#include "design/disk_loop.hpp"
#include "design/ends_of_lines.hpp"
#include "design/polynomial.hpp"

namespace resonid::design {
namespace {

using Complex = std::complex<double>;
/// How far those of kStepsBelowFirstLine are apart, relative.
constexpr double kStepBelow = 5e-3;

/// A controller that is given whole, outside the lines.
struct WholeController {
  std::function<Complex(double)> at_hz;
  ControllerByLines outside;
};

class DiskSearch {
 public:
  /// `filter_at` stands behind the gains; of a controller that is given whole it is all of it, and the gains
  /// are 1 and 0.
  template <class Filter>
  DiskSearch(const ResponseDisks& response, Filter&& filter_at, const Bounds& bounds,
             std::optional<AntiResonance> load, double filter_beyond,
             std::optional<WholeController> whole = {})
      : bounds_(bounds),
        transfers_(bounded_transfers(bounds)),
        whole_(std::move(whole)),
        filter_beyond_(filter_beyond) {
    auto filled =
        between_lines(response.frequencies_hz, response.centres, response.radii, response.known_delay_s);
    const std::vector<Complex> filter = filter_at(filled.frequencies_hz);
    for (std::size_t i = 0; i < filter.size(); ++i) {
      const double f = filled.frequencies_hz[i];
      DiskLine line{f,
                    filter[i],
                    integrator_at(f, response.sample_time_s),
                    filter[i] * filled.values[i],
                    filled.radii[i] * std::abs(filter[i]),
                    0.0};
      if (load) {
        const Complex s(0.0, f / load->frequency_hz);
        const Complex damped = 1.0 + 2.0 * load->damping_ratio * s;
        line.load = std::abs(damped / (damped + s * s));
      }
      lines_.push_back(line);
    }
    is_measured_ = std::move(filled.measured);
    machine_ = whole_ ? response.centres.front() : lines_.front().measured;
    std::vector<double> sizes;
    for (const Complex& value : response.centres) sizes.push_back(std::abs(value));
    end_ = machine_end(response.frequencies_hz, sizes, response.radii, response.sample_time_s);
  }

  struct Gains {
    double kp = 0.0, ki = 0.0;
  };

  /// As for a model (docs/methods/tune.md 4.4): values of kp, then nearer and nearer around the best.
  [[nodiscard]] std::optional<Gains> best() const {
    constexpr int kGains = 60, kZooms = 12, kHalf = 4;
    const double limit = largest_proportional();
    if (!std::isfinite(limit)) return std::nullopt;
    std::optional<Gains> best;
    const auto look = [&](double kp) {
      const double ki = kp > 0.0 ? largest_integral(kp) : 0.0;
      if (ki > (best ? best->ki : 0.0) && is_told_stable({kp, 0.5 * ki}) && is_told_stable({kp, ki}))
        best = {kp, ki};
    };
    for (int i = 1; i < kGains; ++i) look(limit * i / kGains);
    if (!best) return best;
    double distance = limit / kGains;
    for (int round = 0; round < kZooms; ++round) {
      const double centre = best->kp;
      for (int i = -kHalf; i <= kHalf; ++i) look(centre + distance * i / (kHalf + 1.0));
      distance /= kHalf + 1.0;
    }
    return best;
  }

  /// Of 1 + L between neighbouring lines.
  [[nodiscard]] double largest_turn_deg(const Gains& gains) const {
    double most = 0.0;
    for (const auto& turn : turns(gains)) most = std::max(most, std::abs(turn.angle));
    return most * 180.0 / kPi;
  }

  /// By 1 + L of the centres: poles on the circle, those of the controller and that of the drive, make it
  /// begin at -90 deg each; of a stable loop it ends at 0 (the argument principle).
  [[nodiscard]] LineStability along(const Gains& gains) const {
    constexpr double kMostTurnDeg = 90.0;
    if (!begins_as_inertia(machine_))
      return {LinesTell::wrong_sign, lines_.front().frequency_hz,
              std::arg(machine_ * Complex(0.0, 1.0)) * 180.0 / kPi};
    const auto all = turns(gains);
    for (const auto& turn : all)
      if (const double deg = std::abs(turn.angle) * 180.0 / kPi; !(deg < kMostTurnDeg))
        return {LinesTell::turns_far, turn.frequency_hz, deg};
    const auto begin = begins_at(gains);
    if (!begin) return {LinesTell::unstable};
    double around = *begin - std::arg(returned(lines_.size() - 1, gains));
    for (const auto& turn : all) around += turn.angle;
    return {std::abs(around) < 0.5 * kPi ? LinesTell::stable : LinesTell::unstable};
  }
  [[nodiscard]] bool is_told_stable(const Gains& gains) const {
    return along(gains).tells == LinesTell::stable;
  }

  /// Of every response within the disks.
  [[nodiscard]] LineStability stability(const Gains& gains) const {
    if (const auto found = along(gains); found.tells != LinesTell::stable) return found;
    for (std::size_t i = 0; i < lines_.size(); ++i)
      if (const DiskLoop loop(lines_[i], gains.kp, gains.ki); !(std::abs(loop.returned) > loop.reach))
        return {is_measured_[i] ? LinesTell::passes_zero : LinesTell::passes_zero_between,
                lines_[i].frequency_hz, std::abs(loop.returned - 1.0)};
    if (!ends_too_large(end_, largest_beyond(gains))) return {};
    return {end_.is_below_resonance() ? LinesTell::ends_below_resonance : LinesTell::ends_large,
            lines_.back().frequency_hz, largest_loop_beyond(gains), whole_ && whole_->outside.grows};
  }

  [[nodiscard]] const MachineEnd& end() const { return end_; }
  /// From the last line on.
  [[nodiscard]] double largest_loop_beyond(const Gains& gains) const {
    return end_.size * largest_beyond(gains);
  }

  [[nodiscard]] double least_loop_at_start(const Gains& gains) const {
    const DiskLoop loop(lines_.front(), gains.kp, gains.ki);
    return std::abs(loop.returned - 1.0) - loop.reach;
  }

  /// The last frequency at which |L| falls through 1, or nothing where it never does.
  [[nodiscard]] std::optional<double> crossover_hz(const Gains& gains) const {
    const auto size = [&](std::size_t i) {
      return std::log(std::abs(DiskLoop(lines_[i], gains.kp, gains.ki).returned - 1.0));
    };
    for (std::size_t i = lines_.size() - 1; i > 0; --i) {
      const double below = size(i - 1), above = size(i);
      if (below >= 0.0 && above < 0.0)
        return lines_[i - 1].frequency_hz +
               (lines_[i].frequency_hz - lines_[i - 1].frequency_hz) * below / (below - above);
    }
    return std::nullopt;
  }

  [[nodiscard]] std::vector<Peak> worst(const Gains& gains) const {
    std::vector<Peak> found;
    for (const Transfer transfer : transfers_) {
      Peak peak{transfer, 0.0, 0.0, *bound_of(bounds_, transfer)};
      for (const DiskLine& line : lines_)
        if (const double size = DiskLoop(line, gains.kp, gains.ki).size_of(transfer); size > peak.value) {
          peak.value = size;
          peak.frequency_hz = line.frequency_hz;
        }
      found.push_back(peak);
    }
    found.push_back({Transfer::beyond_band, largest_loop_beyond(gains) / end_.largest_loop(),
                     lines_.back().frequency_hz, 1.0});
    return found;
  }

 private:
  /// Gains with a filter fall above the last line, or the filter grows.
  [[nodiscard]] double largest_beyond(const Gains& gains) const {
    return whole_ ? whole_->outside.largest_beyond
                  : std::abs(gains.kp + gains.ki * lines_.back().integrator) * filter_beyond_;
  }

  /// |kp + ki q| where |L| is as large as it may be at the last line.
  [[nodiscard]] double largest_at_end() const { return end_.largest_loop() / (end_.size * filter_beyond_); }

  /// The ki up to which |L| is small enough there.
  [[nodiscard]] double largest_integral_at_end(double kp) const {
    const Complex& q = lines_.back().integrator;
    const double most = largest_at_end(), a = square_of(q), b = kp * q.real(), c = kp * kp - most * most;
    return c < 0.0 ? (std::sqrt(b * b - a * c) - b) / a : 0.0;
  }

  /// The least of |1 + L| that the bound on |S| leaves, or that keeps -1 out of every disk.
  [[nodiscard]] double least_distance() const {
    constexpr double kAny = 1e-3;
    return bounds_.sensitivity ? 1.0 / *bounds_.sensitivity : kAny;
  }

  /// Where |S|, or |C S| by |1 + L| >= (rho + 1/M) |C|, exceeds its bound at a line, over kp or ki: 1 + L is
  /// x0 + x x1, and (kp + ki q) is c0 + x c1.
  [[nodiscard]] double first_end(const DiskLine& line, const Complex& x0, const Complex& x1,
                                 const Complex& c0, const Complex& c1) const {
    double end = first_exceeding(x0, x1, c0 * line.radius, c1 * line.radius, least_distance());
    if (bounds_.controller_sensitivity) {
      const double reach = line.radius + std::abs(line.filter) / *bounds_.controller_sensitivity;
      end = std::min(end, first_exceeding(x0, x1, c0 * reach, c1 * reach, 0.0));
    }
    return end;
  }

  [[nodiscard]] double largest_proportional() const {
    double least = largest_at_end();
    for (const DiskLine& line : lines_)
      least = std::min(least, first_end(line, 1.0, line.measured, 0.0, 1.0));
    return least;
  }

  /// The other bounds have no polynomial: scanned up to where these end, and bisected.
  [[nodiscard]] double largest_integral(double kp) const {
    double end = largest_integral_at_end(kp);
    if (!(end > 0.0)) return 0.0;
    for (const DiskLine& line : lines_) {
      const Complex moved = plain_product(line.measured, line.integrator);
      end = std::min(end, first_end(line, 1.0 + kp * line.measured, moved, kp, line.integrator));
      if (!(end > 0.0)) return 0.0;
    }
    if (!std::isfinite(end)) return 0.0;
    constexpr int kSteps = 60, kHalvings = 45;
    double low = 0.0;
    if (!meets(kp, low)) return 0.0;
    for (int i = 1; i <= kSteps; ++i) {
      double high = end * i / kSteps;
      if (meets(kp, high)) {
        low = high;
        continue;
      }
      for (int k = 0; k < kHalvings; ++k) {
        const double middle = 0.5 * (low + high);
        (meets(kp, middle) ? low : high) = middle;
      }
      return low;
    }
    return end;
  }

  /// All bounds that have no polynomial.
  [[nodiscard]] bool meets(double kp, double ki) const {
    return std::all_of(lines_.begin(), lines_.end(), [&](const DiskLine& line) {
      const DiskLoop loop(line, kp, ki);
      return std::all_of(transfers_.begin(), transfers_.end(), [&](Transfer transfer) {
        return transfer == Transfer::sensitivity || transfer == Transfer::controller_sensitivity ||
               loop.size_of(transfer) <= *bound_of(bounds_, transfer);
      });
    });
  }

  [[nodiscard]] Complex returned(std::size_t i, const Gains& gains) const {
    return DiskLoop(lines_[i], gains.kp, gains.ki).returned;
  }
  /// From one measured line to the next, by what lies between them.
  struct Turn {
    double frequency_hz = 0.0, angle = 0.0;
  };
  [[nodiscard]] std::vector<Turn> turns(const Gains& gains) const {
    std::vector<Turn> found;
    double angle = 0.0;
    auto before = returned(0, gains);
    for (std::size_t i = 1; i < lines_.size(); ++i) {
      const auto now = returned(i, gains);
      angle += std::arg(now * std::conj(before));
      before = now;
      if (!is_measured_[i]) continue;
      found.push_back({lines_[i].frequency_hz, angle});
      angle = 0.0;
    }
    return found;
  }

  [[nodiscard]] std::optional<double> begins_at(const Gains& gains) const {
    const DiskLine& first = lines_.front();
    if (whole_)
      return angle_at_first_line(machine_, whole_->outside.integrators, kStepsBelowFirstLine,
                                 [&](double part) { return whole_->at_hz(first.frequency_hz * part); });
    return angle_at_first_line(machine_, 1.0, kStepsBelowFirstLine / 10,
                               [&](double part) { return gains.kp + gains.ki * first.integrator / part; });
  }

  const Bounds& bounds_;
  std::vector<Transfer> transfers_;
  std::optional<WholeController> whole_;
  std::vector<DiskLine> lines_;  ///< And places between them.
  std::vector<bool> is_measured_;
  Complex machine_;  ///< Its response at the first line.
  MachineEnd end_;
  double filter_beyond_ = 1.0;  ///< The largest of the filter behind the gains from the last line on.
};

}  // namespace

expected<ResponseDisks> response_disks(const data::FrequencyResponse& measured, double confidence,
                                       double sample_time_s) {
  if (!(confidence > 0.0 && confidence < 1.0))
    return refuse("confidence", "must be between 0 and 1", confidence);
  if (!(sample_time_s > 0.0)) return refuse("sample_time_s", "must be > 0", sample_time_s);
  if (measured.std.size() != measured.lines())
    return refuse("std", "must be known on every line", static_cast<double>(measured.std.size()));
  const double each =
      1.0 - (1.0 - confidence) / static_cast<double>(std::max<std::size_t>(1, measured.lines()));
  ResponseDisks disks{measured.frequency_hz, measured.value, {}, sample_time_s};
  for (const double std : measured.std) disks.radii.push_back(data::confidence_radius(std, each));
  return disks;
}

namespace {

expected<void> check_disks(const ResponseDisks& response, const Bounds& bounds,
                           const std::optional<AntiResonance>& load) {
  const auto& f = response.frequencies_hz;
  constexpr std::size_t kFewest = 10;
  if (f.size() < kFewest)
    return refuse("frequencies_hz", "must have at least 10 lines", static_cast<double>(f.size()));
  if (response.centres.size() != f.size() || response.radii.size() != f.size())
    return refuse("radii", "must be as many as there are lines", static_cast<double>(response.radii.size()));
  if (!(f.front() > 0.0) || !(f.back() * response.sample_time_s <= 0.5) ||
      std::adjacent_find(f.begin(), f.end(), std::greater_equal<>()) != f.end())
    return refuse("frequencies_hz", "must ascend between 0 and half of the sample rate");
  if (bounds.load_transfer && !(load && load->frequency_hz > 0.0 && load->damping_ratio >= 0.0))
    return refuse("load_transfer", "needs the anti-resonance and its damping ratio", *bounds.load_transfer);
  return {};
}

}  // namespace

namespace {

/// A pole pair of a controller, half as wide as it is to 3 dB.
struct ControllerMode {
  double frequency_hz = 0.0, half_width_hz = 0.0;
};
struct ControllerPoles {
  int integrators = 0;
  std::vector<ControllerMode> modes;
};

expected<ControllerPoles> poles_of(data::TransferFunction controller) {
  constexpr double kSame = 1e-6;  // a double pole is found to the root of the rounding
  ControllerPoles found;
  auto& denominator = controller.denominator;
  for (; denominator.size() > 1 && data::has_root_at_one(denominator); ++found.integrators)
    data::divide_by_integrator(denominator);
  for (const Complex& pole : controller.poles()) {
    if (!(std::abs(pole) < 1.0 - kSame))
      return refuse("controller", "must be stable but for integrators, to be judged by a response",
                    std::abs(pole));
    if (!(pole.imag() > 0.0)) continue;
    const Complex s = std::log(pole) / (kTwoPi * controller.sample_time_s);
    found.modes.push_back({s.imag(), -s.real()});
  }
  return found;
}

/// Between lines only the controller is known: where they are near enough for its modes, it turns by little
/// from one to the next.
expected<void> check_modes(const ControllerPoles& poles, const std::vector<double>& lines_hz) {
  for (const auto& mode : poles.modes) {
    const double f = mode.frequency_hz;
    const auto above = std::ranges::upper_bound(lines_hz, f);
    if (above == lines_hz.end()) continue;
    const double apart = above == lines_hz.begin() ? kStepBelow * f : *above - *std::prev(above);
    if (!(apart <= mode.half_width_hz))
      return refuse(
          "controller",
          "must have no pole pair that is half as wide as the lines are apart where it stands, in Hz",
          mode.half_width_hz);
  }
  return {};
}

double largest_beyond(const data::TransferFunction& controller, const ControllerPoles& poles,
                      double last_hz) {
  constexpr int kSteps = 400;
  const double nyquist = 0.5 / controller.sample_time_s;
  double most = 0.0;
  const auto look_at = [&](double f) { most = std::max(most, std::abs(controller.response(f))); };
  for (int i = 0; i <= kSteps; ++i) look_at(last_hz + (nyquist - last_hz) * i / kSteps);
  for (const auto& mode : poles.modes)
    if (mode.frequency_hz > last_hz) look_at(mode.frequency_hz);
  return most;
}

}  // namespace

expected<ControllerByLines> controller_by_lines(const data::TransferFunction& controller,
                                                const std::vector<double>& lines_hz) {
  constexpr double kGrows = 1.05;
  if (data::vanishes_at_one(controller.numerator))
    return refuse("controller", "must have a gain at standstill: without one any load runs away");
  const auto poles = poles_of(controller);
  if (!poles) return tl::unexpected(poles.error());
  if (const auto near = check_modes(*poles, lines_hz); !near) return tl::unexpected(near.error());
  const double beyond = largest_beyond(controller, *poles, lines_hz.back());
  return ControllerByLines{poles->integrators, beyond,
                           beyond > kGrows * std::abs(controller.response(lines_hz.back()))};
}

expected<ResponseDesign> largest_integral_gain(const ResponseDisks& response, std::span<const Biquad> biquads,
                                               const Bounds& bounds, std::optional<AntiResonance> load) {
  if (const auto valid = check_disks(response, bounds, load); !valid) return tl::unexpected(valid.error());
  const auto filter_at = [&](std::span<const double> f) {
    return filter_values(biquads, f, response.sample_time_s);
  };
  const FilteredPi alone{1.0, 0.0, {biquads.begin(), biquads.end()}};
  const auto outside =
      controller_by_lines(alone.transfer_function(response.sample_time_s), response.frequencies_hz);
  if (!outside) return refuse("biquads", outside.error().requirement.str());
  const DiskSearch search(response, filter_at, bounds, load, outside->largest_beyond);
  const auto best = search.best();
  constexpr const char* kBelowResonance =
      "must not end below a resonance, where it rises or falls as before an anti-resonance; excite beyond it";
  if (!best && search.end().is_below_resonance()) return refuse("response", kBelowResonance);
  if (!best)
    return refuse("response",
                  "must let a gain within the bounds be told stable: from below the crossover on, on lines "
                  "near to one another");
  const auto crossover_hz = search.crossover_hz(*best);
  if (const double first = search.least_loop_at_start(*best); !crossover_hz || !(first > 1.0))
    return search.end().is_below_resonance() ? refuse("response", kBelowResonance)
                                             : refuse("response", "must begin where |L| is above 1", first);
  return ResponseDesign{{*crossover_hz,
                         search.worst(*best),
                         search.largest_turn_deg(*best),
                         {},
                         search.end(),
                         search.largest_loop_beyond(*best)},
                        {best->kp, best->ki, {biquads.begin(), biquads.end()}}};
}

expected<ResponseLoop> judged_by_response(const ResponseDisks& response,
                                          const data::TransferFunction& controller, const Bounds& bounds,
                                          std::optional<AntiResonance> load) {
  if (const auto valid = check_disks(response, bounds, load); !valid) return tl::unexpected(valid.error());
  const auto outside = controller_by_lines(controller, response.frequencies_hz);
  if (!outside) return tl::unexpected(outside.error());
  const LinearController whole(controller);
  const DiskSearch search(
      response, [&whole](std::span<const double> f) { return whole.at(f); }, bounds, load, 1.0,
      WholeController{[&whole](double f) { return whole.at(std::array{f}).front(); }, *outside});
  constexpr DiskSearch::Gains kAsGiven{1.0, 0.0};
  const auto crossover_hz = search.crossover_hz(kAsGiven);
  if (const double first = search.least_loop_at_start(kAsGiven); !crossover_hz || !(first > 1.0))
    return refuse("response", "must begin where |L| is above 1 and reach to where it is below", first);
  return ResponseLoop{*crossover_hz,
                      search.worst(kAsGiven),
                      search.largest_turn_deg(kAsGiven),
                      search.stability(kAsGiven),
                      search.end(),
                      search.largest_loop_beyond(kAsGiven)};
}

}  // namespace resonid::design
