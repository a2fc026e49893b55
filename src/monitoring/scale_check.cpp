// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/identify/measure/orientation.hpp>
#include <monitoring/scale_check.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/intact.hpp>
#include <resonid/base/detail/number_text.hpp>
#include <resonid/data/frequency_response.hpp>
#include <type_traits>

namespace resonid::monitoring {
namespace {

static_assert(std::is_trivially_copyable_v<ScaleCheck>);

using Complex = ScaleLines::Complex;

constexpr double kWrong = 0.25, kWrongDeviations = 6.0;
constexpr double kWellKnown = 0.08;       // standard deviation of a multiple
constexpr double kExactness = 0.02;       // of a line: windows leak, controllers round
constexpr double kLeft = 0.1;             // of the misfit, where multiples explain it
constexpr double kFewestBlocks = 8.0;     // of a line
constexpr double kFewestOrienting = 5.0;  // of one that may tell the sign
constexpr std::size_t kFewestLines = 3;
constexpr double kOrientationBelow = 1.0 / 12.0;  // of the rate: beyond, an unknown delay turns the phase
constexpr double kAlike = 0.1;
constexpr double kSameShape = 0.05, kFollows = 0.98, kSpread = 4.0;
constexpr double kAwake_s = 10.0;
constexpr std::uint64_t kRestOf = 7;
constexpr double kMovesKeep = 0.97, kFewestMoves = 20.0, kMovesAlike = 0.95;
constexpr double kMove_s = 0.1;

/// 1/coherence - 1 over the blocks: relative variance of a ratio.
double scatter(Complex xe, double xx, double ee, double blocks) noexcept {
  return (xx * ee / std::norm(xe) - 1.0) / (blocks - 1.0);
}

bool is_wrong(double found, double std) noexcept {
  const double off = std::abs(found - 1.0);
  return off > kWrong && off > kWrongDeviations * std;
}

/// The plant's velocity response at the lines that may tell its sign.
data::FrequencyResponse plant_lines(const ScaleLines& lines, double rate_hz, double delay_s,
                                    data::OutputQuantity quantity, bool has_excitation) {
  data::FrequencyResponse g;
  for (std::size_t i = 0; i < ScaleLines::kLines; ++i) {
    const auto& line = lines[i];
    const double hz = lines.frequency_hz(i);
    if (line.blocks < kFewestOrienting || hz > kOrientationBelow * rate_hz) continue;
    const Complex u = has_excitation ? line.ae : Complex(line.aa);
    const Complex y = has_excitation ? line.be : std::conj(line.ab);
    const double ee = has_excitation ? line.ee : line.aa;
    const Complex jw(0.0, kTwoPi * hz);
    Complex value =
        -(y * lines.denominator(i)) / (u * lines.numerator(i)) * std::exp(jw * (delay_s + 0.5 / rate_hz));
    if (quantity == data::OutputQuantity::position) value *= jw;
    if (quantity == data::OutputQuantity::acceleration) value /= jw;
    const double variance = scatter(y, line.bb, ee, line.blocks) + scatter(u, line.aa, ee, line.blocks);
    if (!std::isfinite(std::norm(value)) || !std::isfinite(variance)) continue;
    g.frequency_hz.push_back(hz);
    g.value.push_back(value);
    g.std.push_back(std::abs(value) * std::sqrt(std::max(variance, 0.0)));
  }
  return g;
}

}  // namespace

ScaleCheck::ScaleCheck(const AxisSpec& spec, const data::TransferFunction* controller)
    : sample_rate_hz_(spec.sample_rate_hz),
      delay_s_(spec.track.common.delay_s),
      quantity_(spec.output_quantity),
      has_excitation_(spec.has_excitation) {
  const bool velocity = quantity_ == data::OutputQuantity::velocity;
  constexpr std::size_t kMost = ScaleLines::kMaxOrder + 1;
  has_controller_ = controller != nullptr && velocity && !controller->numerator.empty() &&
                    controller->numerator.size() <= kMost && !controller->denominator.empty() &&
                    controller->denominator.size() <= kMost;
  lines_ = has_controller_ ? ScaleLines(sample_rate_hz_, controller->numerator, controller->denominator)
                           : ScaleLines(sample_rate_hz_, {}, {});
  // A rotary axis may carry a slide, whose position has another unit.
  has_position_ = spec.has_position && velocity && spec.motion == data::Motion::linear;
  reset();
}

void ScaleCheck::reset() noexcept {
  lines_.reset();
  verified_ = false;
  awake_ = asleep_ = 0;
  until_look_ = static_cast<std::uint64_t>(std::max(1.0, std::round(sample_rate_hz_)));
  start_ = std::numeric_limits<double>::quiet_NaN();
  moves_ = vv_ = vp_ = pp_ = 0.0;
  finding_ = {};
}

void ScaleCheck::miss(std::uint64_t count) noexcept {
  lines_.interrupt();
  start_ = std::numeric_limits<double>::quiet_NaN();
  asleep_ -= std::min(asleep_, count);
}

void ScaleCheck::step(const online::AxisSample<double>& sample, double position) {
  if (asleep_ > 0) {
    if (--asleep_ == 0) reset();
    return;
  }
  if (!std::isfinite(sample.excitation + sample.torque + sample.output)) return miss(1);
  lines_.step(sample.excitation, sample.torque, sample.output);
  if (has_position_) step_position(sample.output, position);
  ++awake_;
  if (--until_look_ == 0) look();
}

void ScaleCheck::step_position(double velocity, double position) noexcept {
  if (!std::isfinite(position)) {
    start_ = position;
    return;
  }
  if (!std::isfinite(start_)) {
    start_ = position;
    integral_ = 0.0;
    block_ = 0;
  } else {
    integral_ += 0.5 * (velocity + newest_) / sample_rate_hz_;
    if (static_cast<double>(++block_) >= std::max(8.0, kMove_s * sample_rate_hz_)) {
      const double moved = position - start_;
      vv_ = kMovesKeep * vv_ + integral_ * integral_;
      vp_ = kMovesKeep * vp_ + integral_ * moved;
      pp_ = kMovesKeep * pp_ + moved * moved;
      moves_ = kMovesKeep * moves_ + 1.0;
      start_ = position;
      integral_ = 0.0;
      block_ = 0;
    }
  }
  newest_ = velocity;
}

/// From all lines that are coherent with ru: ae/ee = g + c be/ee, by weighted least squares.
ScaleCheck::Multiples ScaleCheck::with_excitation() const {
  Multiples m;
  double left = 0.0, at_one = 0.0;
  constexpr int kRounds = 4;  // the weights hang on the multiples
  for (int round = 0; round < kRounds; ++round) {
    double gg = 0.0, gc = 0.0, cc = 0.0, gz = 0.0, cz = 0.0;
    std::size_t used = 0;
    left = at_one = 0.0;
    for (std::size_t i = 0; i < ScaleLines::kLines; ++i) {
      const auto& l = lines_[i];
      if (l.blocks < kFewestBlocks || !(l.ee > 0.0)) continue;
      const Complex z = l.ae / l.ee, h = l.be / l.ee;
      const double h_std = std::abs(h) * std::sqrt(std::max(0.0, scatter(l.be, l.bb, l.ee, l.blocks)));
      if (!(h_std < kAlike * (1.0 + std::abs(h)))) continue;
      const double g = m.excitation, c = m.controller;
      // |a - c b - g e|^2
      const double power = l.aa + c * c * l.bb + g * g * l.ee - 2.0 * c * l.ab.real() -
                           2.0 * g * l.ae.real() + 2.0 * c * g * l.be.real();
      const double scale = std::abs(g) + std::abs(c * h);
      const double variance =
          std::max(0.0, power) / (l.ee * (l.blocks - 1.0)) + kExactness * kExactness * scale * scale;
      if (!(variance > 0.0) || !std::isfinite(variance)) continue;
      const double w = 2.0 / variance;
      ++used;
      left += w * std::norm(z - g - c * h);
      at_one += w * std::norm(z - 1.0 - h);
      gg += w;
      gc += w * h.real();
      cc += w * std::norm(h);
      gz += w * z.real();
      cz += w * (z * std::conj(h)).real();
    }
    const double determinant = gg * cc - gc * gc;
    if (used < kFewestLines || !(determinant > 1e-9 * gg * cc)) return {};
    if (round + 1 == kRounds) {
      const double spread = std::max(1.0, left / static_cast<double>(2 * used - 2));
      m.excitation_std = std::sqrt(spread * cc / determinant);
      m.controller_std = std::sqrt(spread * gg / determinant);
      break;
    }
    m.excitation = (gz * cc - cz * gc) / determinant;
    m.controller = (cz * gg - gz * gc) / determinant;
  }
  m.known = m.excitation_std < kWellKnown * std::max(1.0, std::abs(m.excitation)) &&
            m.controller_std < kWellKnown * std::max(1.0, std::abs(m.controller));
  m.explain = left < kLeft * at_one;
  return m;
}

/// Where r is constant u = -C y, at all lines.
ScaleCheck::Multiples ScaleCheck::without_excitation() const {
  Multiples m;
  double w = 0.0, z = 0.0, zz = 0.0, low_hz = 0.0, high_hz = 0.0;
  std::size_t lines = 0, follow = 0;
  for (std::size_t i = 0; i < ScaleLines::kLines; ++i) {
    const auto& l = lines_[i];
    if (l.blocks < kFewestBlocks || !(l.bb > 0.0) || !(l.aa > 0.0)) continue;
    ++lines;
    if (std::norm(l.ab) < kFollows * l.aa * l.bb) continue;
    if (++follow == 1) low_hz = lines_.frequency_hz(i);
    high_hz = lines_.frequency_hz(i);
    const Complex one = l.ab / l.bb;
    w += 1.0;
    z += one.real();
    zz += std::norm(one);
  }
  if (follow <= kFewestLines || 5 * follow < 4 * lines || high_hz < kSpread * low_hz) return m;
  m.controller = z / w;
  m.controller_std = std::sqrt(std::max(0.0, zz / w - m.controller * m.controller) / (w - 1.0));
  m.excitation_std = 0.0;
  // The machine itself may be what makes u and y coherent: then the sign is open.
  m.known = m.controller > 0.0 &&
            zz / w - m.controller * m.controller < kSameShape * kSameShape * m.controller * m.controller;
  m.explain = true;
  return m;
}

/// True when the loop is as told.
bool ScaleCheck::judge_loop(bool lags, bool leads) {
  const Multiples m = has_excitation_ ? with_excitation() : without_excitation();
  if (!m.known) {
    if (leads) finding_ = {ScaleFault::output_sign};
    return false;
  }
  const double c = m.controller, g = m.excitation;
  const bool wrong_c = is_wrong(c, m.controller_std), wrong_g = is_wrong(g, m.excitation_std);
  if (!wrong_c && !wrong_g) return true;
  if (!m.explain) return false;
  if (wrong_c && wrong_g && std::abs(c - g) < kAlike * std::abs(g))
    finding_ = {ScaleFault::input, g, m.excitation_std};
  else if (wrong_g)
    finding_ = {ScaleFault::excitation, g, m.excitation_std};
  else if (c > 0.0)
    finding_ = {ScaleFault::controller, c, m.controller_std};
  else
    finding_ = {lags ? ScaleFault::controller_sign : ScaleFault::output_sign, c, m.controller_std};
  return false;
}

/// True when the position moves with the output.
bool ScaleCheck::judge_position() {
  if (moves_ < kFewestMoves || !(vp_ * vp_ > kMovesAlike * vv_ * pp_)) return false;
  const double found = vp_ / vv_;
  const double std =
      std::abs(found) * std::sqrt(std::max(0.0, vv_ * pp_ / (vp_ * vp_) - 1.0) / (moves_ - 1.0));
  if (!is_wrong(found, std)) return true;
  finding_ = {ScaleFault::position, found, std};
  return false;
}

void ScaleCheck::look() {
  using identification::detail::Orientation;
  until_look_ = static_cast<std::uint64_t>(std::max(1.0, std::round(sample_rate_hz_)));
  finding_ = {};
  auto plant = plant_lines(lines_, sample_rate_hz_, delay_s_, quantity_, has_excitation_);
  const auto is_mirrored = [](const data::FrequencyResponse& g) {
    return identification::detail::orientation_of(g).orientation == Orientation::mirrored;
  };
  const bool leads = is_mirrored(plant);
  for (Complex& value : plant.value) value = -value;
  const bool lags = is_mirrored(plant);
  bool fine = lags;
  if (has_controller_)
    fine = judge_loop(lags, leads);
  else if (leads)
    finding_ = {ScaleFault::output_sign};
  if (finding_.fault == ScaleFault::none && has_position_) fine = judge_position() && fine;
  verified_ = fine && finding_.fault == ScaleFault::none;
  if (verified_ && static_cast<double>(awake_) >= kAwake_s * sample_rate_hz_) asleep_ = kRestOf * awake_;
}

bool ScaleCheck::intact() const noexcept {
  return intact_flags(has_excitation_, has_controller_, has_position_, verified_) && until_look_ > 0 &&
         resonid::intact(quantity_, data::OutputQuantity::acceleration) &&
         resonid::intact(finding_.fault, ScaleFault::position) && lines_.intact();
}

std::string scale_text(const ScaleFinding& f) {
  const std::string times = with_error(f.found, f.std);
  switch (f.fault) {
    case ScaleFault::none:
      return {};
    case ScaleFault::output_sign:
      return std::isfinite(f.found)
                 ? fmt::format(
                       "output_scale: the sign is turned round, or that of input_scale or of the "
                       "controller: the input shows {} times the controller that was told",
                       times)
                 : "output_scale: the sign is turned round, or that of input_scale: a positive torque slows "
                   "the "
                   "machine down";
    case ScaleFault::controller_sign:
      return fmt::format(
          "controller: the sign is turned round: the input shows {} times the one that was told", times);
    case ScaleFault::controller:
      return fmt::format(
          "controller: the input shows {} times the gain of the one that was told; where the controller is "
          "right, input_scale or output_scale is not",
          times);
    case ScaleFault::excitation:
      return fmt::format(
          "excitation_scale: the input holds {} times the excitation; it must have the unit and the sign of "
          "the input",
          times);
    case ScaleFault::input:
      return fmt::format(
          "input: it is {} times what controller and excitation make; all must have one unit and sign",
          times);
    case ScaleFault::position:
      return fmt::format("position_scale: the position moves by {} times the integral of the output", times);
  }
  return {};
}

}  // namespace resonid::monitoring
