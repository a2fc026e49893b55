// SPDX-License-Identifier: MIT
#include "design/response_disks.hpp"

#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>

#include "design/disk_loop.hpp"
#include "design/ends_of_lines.hpp"

namespace resonid::design {
namespace {

using Complex = std::complex<double>;

class DiskSearch {
 public:
  DiskSearch(const ResponseDisks& response, std::span<const Biquad> biquads, const Bounds& bounds,
             std::optional<AntiResonance> load)
      : bounds_(bounds), transfers_(bounded_transfers(bounds)) {
    const auto filter = filter_values(biquads, response.frequencies_hz, response.sample_time_s);
    for (std::size_t i = 0; i < filter.size(); ++i) {
      const double f = response.frequencies_hz[i];
      DiskLine line{f,
                    filter[i],
                    integrator_at(f, response.sample_time_s),
                    filter[i] * response.centres[i],
                    response.radii[i] * std::abs(filter[i]),
                    0.0};
      if (load) {
        const Complex s(0.0, f / load->frequency_hz);
        const Complex damped = 1.0 + 2.0 * load->damping_ratio * s;
        line.load = std::abs(damped / (damped + s * s));
      }
      lines_.push_back(line);
    }
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
      if (ki > (best ? best->ki : 0.0) && is_told_stable({kp, 0.5 * ki})) best = {kp, ki};
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
    for (const double turn : turns(gains)) most = std::max(most, std::abs(turn));
    return most * 180.0 / kPi;
  }

  /// Two poles on the circle, that of the controller and that of the drive, make 1 + L begin at -180 deg; of
  /// a stable loop it ends at 0 (the argument principle).
  [[nodiscard]] bool is_told_stable(const Gains& gains) const {
    constexpr double kMostTurnDeg = 90.0;
    if (!begins_as_inertia(lines_.front().measured)) return false;
    if (!(largest_turn_deg(gains) < kMostTurnDeg)) return false;
    double whole = begins_at(gains) - std::arg(returned(lines_.size() - 1, gains));
    for (const double turn : turns(gains)) whole += turn;
    return std::abs(whole) < 0.5 * kPi;
  }

  [[nodiscard]] double loop_at_end(const Gains& gains) const {
    const DiskLoop loop(lines_.back(), gains.kp, gains.ki);
    return std::abs(loop.returned - 1.0) + loop.reach;
  }

  [[nodiscard]] double rise_at_end(const Gains& gains) const {
    std::vector<double> frequencies_hz;
    for (const DiskLine& line : lines_) frequencies_hz.push_back(line.frequency_hz);
    return design::rise_at_end(frequencies_hz,
                               [&](std::size_t i) { return std::abs(returned(i, gains) - 1.0); });
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
    const double at_end = loop_at_end(gains) / kLargestLoopAtEnd;
    found.push_back({Transfer::beyond_band, at_end, lines_.back().frequency_hz, 1.0});
    return found;
  }

 private:
  /// |kp + ki q| where |L| is as large as it may be at the last line.
  [[nodiscard]] double largest_at_end() const {
    return kLargestLoopAtEnd / (std::abs(lines_.back().measured) + lines_.back().radius);
  }

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
  [[nodiscard]] std::vector<double> turns(const Gains& gains) const {
    std::vector<double> found;
    for (std::size_t i = 1; i < lines_.size(); ++i)
      found.push_back(std::arg(returned(i, gains) * std::conj(returned(i - 1, gains))));
    return found;
  }

  [[nodiscard]] double begins_at(const Gains& gains) const {
    constexpr double kDecades = 4.0;
    const DiskLine& first = lines_.front();
    return angle_at_first_line(first.measured, kDecades, -kPi,
                               [&](double part) { return gains.kp + gains.ki * first.integrator / part; });
  }

  const Bounds& bounds_;
  std::vector<Transfer> transfers_;
  std::vector<DiskLine> lines_;
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

expected<ResponseDesign> largest_integral_gain(const ResponseDisks& response, std::span<const Biquad> biquads,
                                               const Bounds& bounds, std::optional<AntiResonance> load) {
  if (const auto valid = check_disks(response, bounds, load); !valid) return tl::unexpected(valid.error());
  const DiskSearch search(response, biquads, bounds, load);
  const auto best = search.best();
  if (!best)
    return refuse("response",
                  "must let a gain within the bounds be told stable: from below the crossover on, on lines "
                  "near to one another");
  // A loop that only just keeps small there would meet that resonance.
  if (const double rise = search.rise_at_end(*best); ends_on_flank(search.loop_at_end(*best), rise))
    return refuse("response", "must not end where |L| rises: a resonance is near", rise);
  const auto crossover_hz = search.crossover_hz(*best);
  if (const double first = search.least_loop_at_start(*best); !crossover_hz || !(first > 1.0))
    return refuse("response", "must begin where |L| is above 1", first);
  return ResponseDesign{{best->kp, best->ki, {biquads.begin(), biquads.end()}},
                        *crossover_hz,
                        search.worst(*best),
                        search.largest_turn_deg(*best)};
}

expected<ResponseDesign> judged_by_response(const ResponseDisks& response, const FilteredPi& controller,
                                            const Bounds& bounds, std::optional<AntiResonance> load) {
  if (const auto valid = check_disks(response, bounds, load); !valid) return tl::unexpected(valid.error());
  const DiskSearch search(response, controller.biquads, bounds, load);
  const DiskSearch::Gains gains{controller.kp, controller.ki};
  const auto crossover_hz = search.crossover_hz(gains);
  if (const double first = search.least_loop_at_start(gains); !crossover_hz || !(first > 1.0))
    return refuse("response", "must begin where |L| is above 1 and reach to where it is below", first);
  return ResponseDesign{controller, *crossover_hz, search.worst(gains), search.largest_turn_deg(gains),
                        search.is_told_stable(gains)};
}

}  // namespace resonid::design
