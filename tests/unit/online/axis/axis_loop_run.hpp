// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <optional>
#include <random>
#include <resonid/base/constants.hpp>
#include <resonid/online/axis.hpp>
#include <resonid/online/excitation/multisine.hpp>
#include <resonid/online/models/detail/model_response.hpp>
#include <resonid/online/models/modes.hpp>
#include <resonid/online/supervision/loop_margins.hpp>
#include <tooth_belt.hpp>
#include <vector>

namespace resonid::test {

/// The tooth belt of Publications II and III at 250 Hz in its cascade, a sample of delay in what is measured,
/// excited by 43 lines from 2.5 to 107.5 Hz.
class BeltLoop {
 public:
  static constexpr double kRateHz = 250.0, kSpacingHz = 2.5, kPlace_m = 0.82;
  static constexpr std::size_t kLines = 43, kPeriod = 100;
  using Sample = online::AxisSample<double>;

  explicit BeltLoop(double noise_rms, double place_m = kPlace_m, std::uint64_t seed = 1)
      : model_(tooth_belt(place_m, 1.0 / kRateHz)),
        noise_(0.0, noise_rms),
        random_(seed),
        ru_(excitation()) {}

  Sample step() {
    const double t = static_cast<double>(samples_++) / kRateHz;
    const double ru = sweep ? 0.3 * std::cos(kTwoPi * sweep->cycles(t)) : ru_.step();
    const double y = measured_[1] + noise_(random_);
    // u = C (0 - y) + ru
    double control = 0.0;
    for (std::size_t i = 2; i > 0; --i) past_y_[i] = past_y_[i - 1];
    past_y_[0] = y;
    for (std::size_t i = 0; i < 3; ++i) control -= controller_.numerator[i] * past_y_[i];
    for (std::size_t i = 1; i < 3; ++i) control -= controller_.denominator[i] * past_control_[i - 1];
    past_control_ = {control, past_control_[0]};
    const double u = control + ru + load;
    advance(u);
    return {ru, u - load, y};
  }
  std::vector<Sample> run(std::size_t samples) {
    std::vector<Sample> out(samples);
    for (Sample& s : out) s = step();
    return out;
  }

  static const std::array<double, kLines>& lines() {
    static const auto hz = [] {
      std::array<double, kLines> l{};
      for (std::size_t i = 0; i < kLines; ++i) l[i] = kSpacingHz * static_cast<double>(i + 1);
      return l;
    }();
    return hz;
  }
  [[nodiscard]] const online::DiscreteModel<double, 3>& model() const { return model_; }
  [[nodiscard]] double resonance_hz() const {
    return online::SampledModes<3>(model_, kRateHz).resonances()[0].frequency_hz;
  }
  [[nodiscard]] double antiresonance_hz() const {
    return online::SampledModes<3>(model_, kRateHz).antiresonances()[0].frequency_hz;
  }
  static std::complex<double> controller(double hz) {
    const auto c = tooth_belt_controller(1.0 / kRateHz);
    const auto back = std::polar(1.0, -kTwoPi * hz / kRateHz);
    return (c.numerator[0] + back * (c.numerator[1] + back * c.numerator[2])) /
           (c.denominator[0] + back * (c.denominator[1] + back * c.denominator[2]));
  }
  /// Delay included.
  [[nodiscard]] std::complex<double> loop_at(double hz) const {
    return online::response(model_, hz, kRateHz) * controller(hz) * std::polar(1.0, -kTwoPi * hz / kRateHz);
  }
  /// On a fine grid.
  [[nodiscard]] online::LoopMargins<double> margins() const {
    online::MarginScan<double> scan;
    for (double hz = 0.2; hz < 0.4999 * kRateHz; hz *= 1.0003)
      scan.step(hz, online::response(model_, hz, kRateHz) * controller(hz) *
                        std::polar(1.0, -kTwoPi * hz / kRateHz));
    return scan.margins();
  }

  std::optional<online::SweepLaw> sweep{};  ///< A chirp in place of the lines.
  double load = 0.0;                        ///< Unknown torque that u does not hold.

 private:
  static online::Multisine<kLines> excitation() {
    const std::array<double, 1> amplitude{0.02};
    return online::Multisine<kLines>::create(
               {.sample_rate_hz = kRateHz, .frequency_hz = lines(), .amplitude = amplitude})
        .value();
  }
  void advance(double u) {
    for (std::size_t i = 2; i > 0; --i) past_u_[i] = past_u_[i - 1];
    past_u_[0] = u;
    double v = 0.0;
    for (std::size_t i = 0; i < 3; ++i) v += model_.b[i] * past_u_[i] - model_.a[i] * past_v_[i];
    past_v_ = {v, past_v_[0], past_v_[1]};
    measured_ = {v, measured_[0]};
  }

  std::uint64_t samples_ = 0;
  online::DiscreteModel<double, 3> model_;
  online::ControllerCoefficients controller_ = tooth_belt_controller(1.0 / kRateHz);
  std::normal_distribution<double> noise_;
  std::mt19937_64 random_;
  online::Multisine<kLines> ru_;
  std::array<double, 3> past_y_{}, past_u_{}, past_v_{};
  std::array<double, 2> past_control_{}, measured_{};
};

/// Start and controller of the belt as an axis is told them, the stiffness 5 % off.
struct BeltTold {
  online::ControllerCoefficients controller = tooth_belt_controller(1.0 / BeltLoop::kRateHz);
  online::DiscreteModel<double, 3> start = tooth_belt(BeltLoop::kPlace_m + 0.05, 1.0 / BeltLoop::kRateHz);

  /// Refers to this object.
  online::AxisConfig config(online::AxisMethod method) const&& = delete;
  [[nodiscard]] online::AxisConfig config(online::AxisMethod method) const& {
    online::AxisConfig c;
    c.sample_rate_hz = BeltLoop::kRateHz;
    c.method = method;
    c.known_delay_s = 1.0 / BeltLoop::kRateHz;
    c.controller_numerator = controller.numerator;
    c.controller_denominator = controller.denominator;
    c.lines_hz = BeltLoop::lines();
    c.window_samples = 2 * BeltLoop::kPeriod;
    c.window = online::DftWindow::hann;
    c.start_b = start.b;
    c.start_a = start.a;
    c.physical.driven_inertia = {0.0028, 0.1};
    c.physical.load_inertia = {6.7 * 0.0199 * 0.0199, 0.1};
    c.physical.stiffness = {230.0, 0.2};
    c.physical.damping = {0.05, 0.5};
    c.row_every_samples = 10;
    return c;
  }
};

/// On the heap: it is large.
inline std::unique_ptr<online::Axis> make_axis(const online::AxisConfig& config) {
  void* memory = ::operator new(sizeof(online::Axis), std::align_val_t(alignof(online::Axis)));
  auto axis = std::unique_ptr<online::Axis>(static_cast<online::Axis*>(memory));
  online::Axis::create_in(memory, config).value();
  return axis;
}

inline bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }
inline bool same(const online::Figure& a, const online::Figure& b) {
  return same(a.value, b.value) && same(a.std, b.std);
}
/// Bit for bit, but for the payload of what is not a number.
inline bool same(const online::AxisRow& a, const online::AxisRow& b) {
  bool equal = a.sample == b.sample && same(a.lag_samples, b.lag_samples) && a.verdict == b.verdict &&
               a.trusted == b.trusted && a.controller_differs == b.controller_differs;
  for (std::size_t i = 0; i < a.parameter.size(); ++i) equal = equal && same(a.parameter[i], b.parameter[i]);
  for (const auto member :
       {&online::AxisRow::resonance_hz, &online::AxisRow::antiresonance_hz, &online::AxisRow::crossover_hz,
        &online::AxisRow::phase_margin_deg, &online::AxisRow::modulus_margin, &online::AxisRow::gap})
    equal = equal && same(a.*member, b.*member);
  for (const auto member :
       {&online::AxisRow::resonance_damping, &online::AxisRow::driven_inertia, &online::AxisRow::stiffness,
        &online::AxisRow::gain_margin_db, &online::AxisRow::coherence, &online::AxisRow::residual_rms,
        &online::AxisRow::uncertainty, &online::AxisRow::controller_difference})
    equal = equal && same(a.*member, b.*member);
  return equal;
}

}  // namespace resonid::test
