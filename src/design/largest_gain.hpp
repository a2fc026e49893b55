// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <complex>
#include <optional>
#include <resonid/design/detail/bounds.hpp>
#include <span>
#include <vector>

#include "design/controller.hpp"
#include "design/machine.hpp"

// The PI controller of the largest integral gain under bounds, and the P of the largest gain, exactly
// (docs/methods/tune.md 4; the idea is that of Astrom et al. 1998 and of Yaniv and Nagurka 2003).
namespace resonid::design {

/// A filtered derivative beside the proportional part, kp (1 + time_s D) with
/// D = (1-p)/Ts (z-1)/(z-p), p = exp(-Ts/filter_s); docs/methods/tune.md 6.5.
struct PidShape {
  double time_s = 0.0;    ///< kd/kp; 0: none.
  double filter_s = 0.0;  ///< Time constant of its lag.
  /// 1 + time_s D
  [[nodiscard]] std::complex<double> at(std::complex<double> inverse_z, double sample_time_s) const;
};

/// Each bound at each frequency of each machine as v' Q v >= 0 with v = [1, kp, ki]
/// (docs/methods/tune.md 4.1).
class QuadraticRows {
 public:
  /// `proportional`: what stands beside the integral part, 1 of a PI.
  void add(const MachineLines::Line& line, const std::complex<double>& filter, const Bounds& bounds,
           const std::complex<double>& proportional = 1.0);
  /// |bounded' v| <= bound |loop' v|, for gains of any other meaning.
  void add(const std::array<std::complex<double>, 3>& loop,
           const std::array<std::complex<double>, 3>& bounded, double bound);
  [[nodiscard]] std::size_t size() const { return q00_.size(); }

  /// Largest kp that meets every bound, from kp = 0 on without a gap, with ki = 0; 0 where that does not.
  [[nodiscard]] double largest_proportional() const;
  /// Largest ki that meets every bound, from ki = 0 on without a gap; negative where ki = 0 does not.
  [[nodiscard]] double largest_integral(double kp) const;

  /// Rows that limited ki at other kp; where they leave less than is wanted, no other row need be looked at.
  struct Recent {
    std::array<std::size_t, 4> rows{};
    std::size_t next = 0;
  };
  /// The same where it exceeds `wanted`, else any number that does not.
  [[nodiscard]] double largest_integral(double kp, double wanted, Recent& recent) const;

 private:
  std::vector<double> q00_, q01_, q02_, q11_, q12_, q22_;
};

/// A PI controller at the largest integral gain, or a P at the largest gain.
struct LargestGain {
  double kp = 0.0, ki = 0.0;
  double exceeded = 0.0;  ///< By what a bound is exceeded between lines, relative.
};

struct Accuracy {
  int gains = 60;      ///< Values of kp that are tried first.
  int zooms = 14;      ///< Rounds of nine values around the best.
  int exchanges = 12;  ///< Rounds in which lines are added where a bound is exceeded between lines.
};

/// Machines that one controller is to suit, each with its lines.
struct Machines {
  explicit Machines(std::vector<Machine> machines, double share = 1.0);
  void add(Machine machine, double share = 1.0);
  std::vector<Machine> all;
  std::vector<MachineLines> lines;
};

/// Stable, and within the bounds at every frequency of every machine. Nothing where no gain is. Lines at
/// which a bound is nearly reached are added to `machines`.
[[nodiscard]] std::optional<LargestGain> largest_integral_gain(Machines& machines,
                                                               std::span<const Biquad> biquads,
                                                               const Bounds& bounds,
                                                               const Accuracy& accuracy = {});
/// The same with a derivative, for a given ratio kd/kp.
[[nodiscard]] std::optional<LargestGain> largest_pid_gain(Machines& machines, const PidShape& shape,
                                                          const Bounds& bounds,
                                                          const Accuracy& accuracy = {});
/// The same on the lines alone, from fewer values of kp: what a search with filters in it asks again and
/// again.
[[nodiscard]] std::optional<LargestGain> rough_integral_gain(const Machines& machines,
                                                             std::span<const Biquad> biquads,
                                                             const Bounds& bounds);
[[nodiscard]] std::optional<LargestGain> rough_pid_gain(const Machines& machines, const PidShape& shape,
                                                        const Bounds& bounds);

/// A P: the largest kp, with ki = 0, that is stable and within the bounds as every smaller one is. Nothing
/// where no gain is. Lines at which a bound is nearly reached are added to `machines`.
[[nodiscard]] std::optional<LargestGain> largest_proportional_gain(Machines& machines, const Bounds& bounds,
                                                                   const Accuracy& accuracy = {});

}  // namespace resonid::design
