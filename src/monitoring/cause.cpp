// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <monitoring/cause.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/statistics.hpp>

namespace resonid::monitoring {
namespace {

using Vector = std::array<double, kWatched>;
using Mask = std::array<bool, kWatched>;

constexpr double kLeastFit = 0.01;
/// Whether much or little happened is not known: sizes and what is free have their usual spread times one of
/// these.
constexpr std::array kScales = {0.1, 0.3, 1.0};
/// Shares of a cause by itself, and of one that brings more with it.
constexpr double kPlain = 0.75, kMixed = 0.25;
/// Stiffness, inertias and frequencies are five figures of three quantities.
constexpr double kDependent = 5.0 / 3.0;
/// What linear directions and models leave out: of a figure, and of the largest shift.
constexpr double kModelError = 0.002, kBending = 0.01;
/// A logarithm of what is known worse than that says nothing.
constexpr double kMostRelativeStd = 0.5;
constexpr double kRadPerDeg = kTwoPi / 360.0;

std::size_t at(Watched w) noexcept { return static_cast<std::size_t>(w); }

/// The shifts in the terms in which causes are directions.
struct Shifts {
  Vector y{}, variance{}, prior_variance{};
  Mask known{};
  double largest = 0.0;
};

/// Standard deviation of the shifts that causes make: of logarithms, radians, and shares.
double usual_shift(Watched w) noexcept {
  switch (w) {
    case Watched::damping:
    case Watched::coulomb_friction:
      return 0.5;
    case Watched::load_torque:
      return 1.0;
    case Watched::phase_margin:
    case Watched::gap:
      return 0.2;
    default:
      return 0.3;
  }
}

bool by_logarithm(Watched w) noexcept {
  return w != Watched::load_torque && w != Watched::phase_margin && w != Watched::gap;
}

/// Torque that load torques are compared with: dry friction where there is one.
double torque_unit(const std::array<FigureShift, kWatched>& shifts) noexcept {
  const double friction = shifts[at(Watched::coulomb_friction)].before.value;
  const FigureShift& load = shifts[at(Watched::load_torque)];
  const double from_load = std::max(std::abs(load.before.value), 10.0 * load.before.std);
  return friction > 0.0 ? std::max(friction, 10.0 * load.before.std) : from_load;
}

void enter(Shifts& out, Watched w, const FigureShift& shift, double unit) noexcept {
  const auto& [before, after] = shift;
  const std::size_t i = at(w);
  double y = 0.0, variance = 0.0;
  if (by_logarithm(w)) {
    const double from = before.std / before.value, to = after.std / after.value;
    if (!(before.value > 0.0 && after.value > 0.0 && from < kMostRelativeStd && to < kMostRelativeStd))
      return;
    y = std::log(after.value / before.value);
    variance = from * from + to * to;
  } else {
    y = (after.value - before.value) * unit;
    variance = (before.std * before.std + after.std * after.std) * unit * unit;
  }
  if (!std::isfinite(y) || !(variance >= 0.0) || !std::isfinite(variance)) return;
  out.known[i] = true;
  out.y[i] = y;
  out.variance[i] = variance;
  out.prior_variance[i] = usual_shift(w) * usual_shift(w);
  out.largest = std::max(out.largest, std::abs(y));
}

constexpr std::initializer_list<Watched> kTwoMasses = {Watched::resonance, Watched::antiresonance,
                                                       Watched::stiffness, Watched::driven_inertia,
                                                       Watched::load_inertia};
bool all_known(const Mask& known, std::initializer_list<Watched> figures) noexcept {
  return std::all_of(figures.begin(), figures.end(), [&](Watched w) { return known[at(w)]; });
}

Shifts entered(const std::array<FigureShift, kWatched>& shifts) noexcept {
  Shifts out;
  for (std::size_t i = 0; i < kWatched; ++i) {
    const auto w = static_cast<Watched>(i);
    const double unit = w == Watched::load_torque    ? 1.0 / torque_unit(shifts)
                        : w == Watched::phase_margin ? kRadPerDeg
                                                     : 1.0;
    enter(out, w, shifts[i], unit);
  }
  const double error = std::hypot(kModelError, kBending * out.largest);
  for (double& v : out.variance) v += error * error;
  if (all_known(out.known, kTwoMasses))
    for (const Watched w : kTwoMasses) out.variance[at(w)] *= kDependent;
  return out;
}

/// A cause's prediction.
struct Hypothesis {
  Cause cause = Cause::unknown;
  Vector direction{};
  double usual_size = 0.0;  ///< tau; 0: nothing moves but what is free.
  bool either_way = false;  ///< Also against the direction.
  Mask free{};
  double prior = 1.0;  ///< Where a cause comes in several forms.

  Hypothesis& moves(Watched w, double by) noexcept {
    direction[at(w)] = by;
    return *this;
  }
  Hypothesis& leaves_free(std::initializer_list<Watched> figures) noexcept {
    for (const Watched w : figures) free[at(w)] = true;
    return *this;
  }
};

struct Verdict {
  double log_likelihood = -std::numeric_limits<double>::infinity();
  double fit = 0.0;
};

double normal_probability(double x) noexcept { return 0.5 * std::erfc(-x / std::sqrt(2.0)); }

Verdict judge(const Shifts& s, const Hypothesis& h, double scale) noexcept {
  double squares = 0.0, log_det = 0.0, dd = 0.0, dy = 0.0;
  std::size_t told = 0;
  for (std::size_t i = 0; i < kWatched; ++i) {
    if (!s.known[i]) continue;
    const double v = s.variance[i] + (h.free[i] ? scale * scale * s.prior_variance[i] : 0.0);
    squares += s.y[i] * s.y[i] / v;
    log_det += std::log(v);
    if (h.free[i]) continue;
    dd += h.direction[i] * h.direction[i] / v;
    dy += h.direction[i] * s.y[i] / v;
    ++told;
  }
  Verdict out;
  const bool moves = h.usual_size > 0.0;
  if (moves && dd == 0.0) return out;  // it says nothing of what is known
  double size = 0.0;
  out.log_likelihood = -0.5 * (squares + log_det);
  if (moves) {
    const double usual = scale * h.usual_size;
    const double precision = dd + 1.0 / (usual * usual), mean = dy / precision;
    out.log_likelihood += 0.5 * mean * mean * precision - 0.5 * std::log(precision * usual * usual);
    if (!h.either_way) out.log_likelihood += std::log(2.0 * normal_probability(mean * std::sqrt(precision)));
    size = h.either_way ? dy / dd : std::max(0.0, dy / dd);
  }
  double left = 0.0;
  for (std::size_t i = 0; i < kWatched; ++i) {
    if (!s.known[i] || h.free[i]) continue;
    const double e = s.y[i] - size * h.direction[i];
    left += e * e / s.variance[i];
  }
  const std::size_t used = moves && size != 0.0 ? 1 : 0;
  out.fit = told > used ? chi_square_tail(left, told - used) : 1.0;
  return out;
}

/// Share of the driven side in the sum of both inertias, between before and now; not a number where unknown.
double driven_share(const std::array<FigureShift, kWatched>& shifts) noexcept {
  const auto middle = [&](Watched w) {
    return std::sqrt(shifts[at(w)].before.value * shifts[at(w)].after.value);
  };
  const double driven = middle(Watched::driven_inertia), load = middle(Watched::load_inertia);
  return driven > 0.0 && load > 0.0 ? driven / (driven + load) : std::numeric_limits<double>::quiet_NaN();
}

/// By how much a factor exp(t) of all torques moves the load's per t, in the unit of its shifts; 0 where
/// unknown.
double load_torque_per_scale(const std::array<FigureShift, kWatched>& shifts) noexcept {
  const FigureShift& load = shifts[at(Watched::load_torque)];
  const double from = load.before.value, to = load.after.value;
  const double ratio = to / from;
  const double middle =
      ratio > 0.0 && std::abs(ratio - 1.0) > 1e-6 ? (to - from) / std::log(ratio) : 0.5 * (from + to);
  const double by = middle / torque_unit(shifts);
  return std::isfinite(by) ? by : 0.0;
}

constexpr std::initializer_list<Watched> kLoop = {Watched::modulus_margin, Watched::phase_margin,
                                                  Watched::gap};
constexpr std::initializer_list<Watched> kLosses = {Watched::damping, Watched::coulomb_friction};

/// All hypotheses. Frequencies follow from  fa^2 ~ K/J2,  fr^2 ~ K (1/J1 + 1/J2).
class Hypotheses {
 public:
  static constexpr std::size_t kMost = 24;
  Hypotheses(double driven_share, double load_torque) noexcept
      : share_(driven_share), load_torque_(load_torque) {
    for (const double way : {-1.0, 1.0}) {
      coupling(way);
      load(way);
      friction(way);
    }
    motor();
    loop();
  }
  [[nodiscard]] const Hypothesis* begin() const noexcept { return list_.data(); }
  [[nodiscard]] const Hypothesis* end() const noexcept { return list_.data() + count_; }

 private:
  Hypothesis& add(Cause cause, double usual_size, double prior = 1.0) noexcept {
    Hypothesis& h = list_[count_++];
    h.cause = cause;
    h.usual_size = usual_size;
    h.prior = prior;
    return h;
  }
  void coupling(double way) noexcept {
    for (const bool losses_stay : {true, false}) {
      Hypothesis& h = add(way < 0.0 ? Cause::coupling_looser : Cause::coupling_stiffer, 0.3,
                          losses_stay ? kPlain : kMixed);
      h.moves(Watched::stiffness, way).moves(Watched::resonance, 0.5 * way);
      h.moves(Watched::antiresonance, 0.5 * way).leaves_free(kLoop);
      if (!losses_stay) h.leaves_free(kLosses);
    }
  }
  void load(double way) noexcept {
    for (const bool weight_stays : {true, false}) {
      Hypothesis& h =
          add(way > 0.0 ? Cause::load_heavier : Cause::load_lighter, 0.3, weight_stays ? kPlain : kMixed);
      h.moves(Watched::load_inertia, way).moves(Watched::antiresonance, -0.5 * way).leaves_free(kLoop);
      // Between nothing and what a coupling makes of it, where the inertias are not known.
      if (std::isnan(share_))
        h.leaves_free({Watched::resonance});
      else
        h.moves(Watched::resonance, -0.5 * way * share_);
      if (!weight_stays) h.leaves_free(kLosses).leaves_free({Watched::load_torque});
    }
  }
  void friction(double way) noexcept {
    const Cause cause = way > 0.0 ? Cause::friction_rose : Cause::friction_fell;
    add(cause, 0.5, 1.0 / 3.0).moves(Watched::damping, way).leaves_free(kLoop);
    add(cause, 0.5, 1.0 / 3.0).moves(Watched::coulomb_friction, way).leaves_free(kLoop);
    add(cause, 0.5, 1.0 / 3.0)
        .moves(Watched::damping, way)
        .leaves_free(kLoop)
        .leaves_free({Watched::coulomb_friction});
  }
  void motor() noexcept {
    Hypothesis& h = add(Cause::motor_inertia, 0.3);
    h.either_way = true;
    h.moves(Watched::driven_inertia, 1.0).leaves_free(kLoop);
    // Where the inertias are not known, its size is that of the resonance.
    h.moves(Watched::resonance, std::isnan(share_) ? -0.5 : -0.5 * (1.0 - share_));
    Hypothesis& scale = add(Cause::input_scale, 0.3, 0.3);  // rare
    scale.either_way = true;
    for (const Watched w : {Watched::stiffness, Watched::driven_inertia, Watched::load_inertia,
                            Watched::damping, Watched::coulomb_friction})
      scale.moves(w, 1.0);
    scale.moves(Watched::load_torque, load_torque_).leaves_free(kLoop);
  }
  void loop() noexcept {
    Hypothesis& torque = add(Cause::load_torque, 1.0);
    torque.either_way = true;
    torque.moves(Watched::load_torque, 1.0);
    for (const bool response_stays : {true, false}) {
      Hypothesis& both = add(Cause::delay_or_gains, 0.3, response_stays ? kPlain : kMixed);
      both.either_way = true;
      both.moves(Watched::modulus_margin, 1.0).leaves_free({Watched::phase_margin});
      if (!response_stays) both.leaves_free({Watched::gap});
    }
    for (const bool margins_stay : {true, false}) {
      Hypothesis& h = add(Cause::not_described, 0.2, margins_stay ? kPlain : kMixed);
      h.moves(Watched::gap, 1.0);
      if (!margins_stay) h.leaves_free({Watched::modulus_margin, Watched::phase_margin});
    }
    add(Cause::unknown, 0.0);  // nothing
    Hypothesis& anything = add(Cause::unknown, 0.0, 0.2);
    anything.free.fill(true);
  }

  std::array<Hypothesis, kMost> list_{};
  std::size_t count_ = 0;
  double share_;
  double load_torque_;  // in the unit of its shifts, between before and now
};

}  // namespace

std::string_view cause_words(Cause cause) noexcept {
  switch (cause) {
    case Cause::unknown:
      return "unknown";
    case Cause::coupling_looser:
      return "belt or coupling looser (inertias unchanged)";
    case Cause::coupling_stiffer:
      return "belt or coupling tightened, or another temperature (inertias unchanged)";
    case Cause::load_heavier:
      return "heavier load (motor inertia unchanged)";
    case Cause::load_lighter:
      return "lighter load (motor inertia unchanged)";
    case Cause::motor_inertia:
      return "motor side: motor, brake or what is fixed to the shaft (load unchanged)";
    case Cause::input_scale:
      return "scale of the input: torque constant or current sensor (frequencies unchanged)";
    case Cause::friction_rose:
      return "more friction: lubrication, bearing or guideway (stiffness and inertias unchanged)";
    case Cause::friction_fell:
      return "less friction: lubrication, bearing or guideway (stiffness and inertias unchanged)";
    case Cause::load_torque:
      return "another load torque: weight, brake or process force (all else unchanged)";
    case Cause::delay_or_gains:
      return "delay or gains of the controller (machine unchanged)";
    case Cause::not_described:
      return "something that the model does not describe: backlash or a further resonance (figures "
             "unchanged)";
  }
  return {};
}

LikelyCause likely_cause(const std::array<FigureShift, kWatched>& shifts) noexcept {
  const Shifts entry = entered(shifts);
  const Hypotheses hypotheses(driven_share(shifts), load_torque_per_scale(shifts));
  std::array<double, kCauses> weight{}, fit{};
  double sum = 0.0, highest = -std::numeric_limits<double>::infinity();
  for (const bool counts : {false, true})  // first for the highest alone, that nothing underflows
    for (const Hypothesis& h : hypotheses)
      for (const double scale : kScales) {
        const Verdict v = judge(entry, h, scale);
        if (v.fit < kLeastFit) continue;
        if (!counts) {
          highest = std::max(highest, v.log_likelihood);
          continue;
        }
        const auto cause = static_cast<std::size_t>(h.cause);
        const double w = h.prior * std::exp(v.log_likelihood - highest);
        weight[cause] += w;
        sum += w;
        fit[cause] = std::max(fit[cause], v.fit);
      }
  LikelyCause out;
  for (std::size_t i = 0; i < kCauses; ++i) out.ranked[i] = {static_cast<Cause>(i), weight[i] / sum};
  std::sort(out.ranked.begin(), out.ranked.end(), [](const auto& a, const auto& b) {
    return a.weight != b.weight ? a.weight > b.weight : a.cause < b.cause;
  });
  out.fit = fit[static_cast<std::size_t>(out.first().cause)];
  return out;
}

}  // namespace resonid::monitoring
