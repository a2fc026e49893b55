// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <limits>
#include <monitoring/axis_spec.hpp>
#include <monitoring/scale_lines.hpp>
#include <resonid/base/enum_names.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/online/axis_result.hpp>
#include <span>
#include <string>

namespace resonid::monitoring {

/// Which of what was told the samples contradict.
enum class ScaleFault : std::uint8_t {
  none,
  output_sign,      ///< A positive torque slows the machine down.
  controller_sign,  ///< The controller told has the other sign.
  controller,       ///< ... another gain.
  excitation,       ///< The input holds another share of it than all.
  input,            ///< It is another multiple of what controller and excitation make than 1.
  position,         ///< It moves by another multiple of the output's integral.
};
inline constexpr EnumName<ScaleFault> kScaleFaultNames[] = {{ScaleFault::none, "none"},
                                                            {ScaleFault::output_sign, "output-sign"},
                                                            {ScaleFault::controller_sign, "controller-sign"},
                                                            {ScaleFault::controller, "controller"},
                                                            {ScaleFault::excitation, "excitation"},
                                                            {ScaleFault::input, "input"},
                                                            {ScaleFault::position, "position"}};
[[nodiscard]] constexpr std::span<const EnumName<ScaleFault>> enum_names(ScaleFault) noexcept {
  return kScaleFaultNames;
}

/// A multiple that was found, 1 where all is right.
struct ScaleFinding {
  ScaleFault fault = ScaleFault::none;
  double found = std::numeric_limits<double>::quiet_NaN();  ///< Not a number for a sign alone.
  double std = std::numeric_limits<double>::quiet_NaN();
};

/// Whether scales, signs and controller are those that were told, from the samples alone:
///
/// - a positive torque accelerates: at the lowest frequencies that are known the velocity lags (the test of
///   identify's finding `reversed`);
/// - u = C (r - y) + ru holds for the parts of u, y and ru that are coherent with ru: the share g of ru and
/// the
///   multiple c of the controller told come from all lines at once (scale_lines.hpp), with standard
///   deviations. Without ru: u = -C y where r is constant, which shows in u and y being coherent throughout
///   with C's own shape;
/// - the position of a linear axis moves as the integral of its velocity.
///
/// A multiple is wrong beyond 25 % and six standard deviations, and only where it explains what is seen:
/// smaller differences, and controllers of another shape, are the engine's to tell (ControllerCheck). Once
/// all is known and right it looks for an eighth of the time. The same samples give the same findings; its
/// bytes are its snapshot.
class ScaleCheck {
 public:
  ScaleCheck() = default;
  /// `controller`: sampled; empty: none is known.
  ScaleCheck(const AxisSpec& spec, const data::TransferFunction* controller);

  /// One sample in the units told; not finite: missing.
  void step(const online::AxisSample<double>& sample, double position);
  void miss(std::uint64_t count) noexcept;
  /// Judges what there is; by itself every second.
  void look();
  void reset() noexcept;

  [[nodiscard]] const ScaleFinding& finding() const noexcept { return finding_; }
  /// All that can be checked has been, and is right.
  [[nodiscard]] bool verified() const noexcept { return verified_; }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept;

 private:
  /// Multiples of excitation and controller.
  struct Multiples {
    double excitation = 1.0, controller = 1.0;
    double excitation_std = std::numeric_limits<double>::infinity();
    double controller_std = std::numeric_limits<double>::infinity();
    bool known = false;
    bool explain = false;  ///< What is left of the difference from 1 is small.
  };
  void step_position(double velocity, double position) noexcept;
  [[nodiscard]] Multiples with_excitation() const;
  [[nodiscard]] Multiples without_excitation() const;
  [[nodiscard]] bool judge_loop(bool lags, bool leads);
  [[nodiscard]] bool judge_position();

  double sample_rate_hz_ = 1.0, delay_s_ = 0.0;
  data::OutputQuantity quantity_ = data::OutputQuantity::velocity;
  bool has_excitation_ = false, has_controller_ = false, has_position_ = false;
  bool verified_ = false;
  ScaleLines lines_;
  std::uint64_t awake_ = 0, asleep_ = 0, until_look_ = 0;  // samples

  double start_ = std::numeric_limits<double>::quiet_NaN();  // of a block: the position
  double integral_ = 0.0, newest_ = 0.0;
  std::uint64_t block_ = 0;                              // samples in it
  double moves_ = 0.0, vv_ = 0.0, vp_ = 0.0, pp_ = 0.0;  // sums over blocks
  ScaleFinding finding_;
};

/// "output_scale: the sign is turned round: ..."; empty without a fault.
[[nodiscard]] std::string scale_text(const ScaleFinding& finding);

}  // namespace resonid::monitoring
