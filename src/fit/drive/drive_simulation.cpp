// SPDX-License-Identifier: MIT
#include <ceres/jet.h>

#include <algorithm>
#include <fit/controller_law.hpp>
#include <fit/drive/drive_simulation.hpp>
#include <numeric>

#include "linalg/decompositions.hpp"

namespace resonid::fit::detail {
namespace {

/// A value's derivatives by the active coordinates.
template <int Columns>
using Slopes = Eigen::Array<double, 1, Columns>;

template <int Columns>
Slopes<Columns> zero() {
  return Slopes<Columns>::Zero();
}

/// The sampled drive with the slopes of its matrices.
template <int Masses, int Columns>
struct SampledSlopes {
  static constexpr int kStates = Sizes<Masses>::kStates;
  SampledDrive<Masses, double> drive;
  std::array<std::array<Slopes<Columns>, kStates>, kStates> a;
  std::array<Slopes<Columns>, kStates> b, c, lag_b;
  Slopes<Columns> d, lag_d, decay, past_d;
  FrictionParts<Masses, double> parts;  ///< With dry friction only.
  std::array<std::array<Slopes<Columns>, kStates>, kFrictionParts> parts_b;
  std::array<Slopes<Columns>, kFrictionParts> parts_d, parts_past_d;
};

template <int Masses, int Columns>
SampledSlopes<Masses, Columns> sampled(const SimulationSetup& setup, const double* x,
                                       std::span<const int> active, bool dry) {
  constexpr int kStates = Sizes<Masses>::kStates, kCount = Sizes<Masses>::kParameters;
  SampledSlopes<Masses, Columns> result;
  const auto with = [&](const auto* coordinates, auto&& make) {
    using T = std::decay_t<decltype(*coordinates)>;
    return make(setup.coordinates.parameters(coordinates, Masses == 3), setup.quantity,
                T(coordinates[kDelay] + T(setup.known_delay_samples)), setup.coordinates.sample_time_s,
                setup.lag, coordinates[kTorqueLag], setup.velocity);
  };
  const auto of = [&](const auto* x_or_jets) {
    return with(x_or_jets, [&](const auto&... a) { return sampled_drive<Masses>(a..., setup.mass); });
  };
  const auto parts_of = [&](const auto* x_or_jets) {
    return with(x_or_jets, [](const auto&... a) { return friction_parts<Masses>(a...); });
  };
  result.drive = of(x);
  if (dry) result.parts = parts_of(x);
  if constexpr (Columns > 0) {
    for (std::size_t part = 0; part < kFrictionParts; ++part) {
      result.parts_b[part].fill(zero<Columns>());
      result.parts_d[part] = result.parts_past_d[part] = zero<Columns>();
    }
    for (int i = 0; i < kStates; ++i) {
      result.a[static_cast<std::size_t>(i)].fill(zero<Columns>());
      const auto at = static_cast<std::size_t>(i);
      result.b[at] = result.c[at] = result.lag_b[at] = zero<Columns>();
    }
    result.d = result.lag_d = result.decay = result.past_d = zero<Columns>();
    if (active.empty() || active.front() >= kCount) return result;
    using Jet = ceres::Jet<double, kCount>;
    std::array<Jet, kCount> jets;
    for (int i = 0; i < kCount; ++i) jets[static_cast<std::size_t>(i)] = Jet(x[i]);
    for (const int p : active)
      if (p < kCount) jets[static_cast<std::size_t>(p)].v(p) = 1.0;
    const auto jet = of(jets.data());
    const auto& s = jet.system;
    for (std::size_t p = 0; p < active.size(); ++p) {
      const int from = active[p];
      if (from >= kCount) continue;
      const auto to = static_cast<Eigen::Index>(p);
      for (int i = 0; i < kStates; ++i) {
        const auto row = static_cast<std::size_t>(i);
        for (int j = 0; j < kStates; ++j) result.a[row][static_cast<std::size_t>(j)](to) = s.a(i, j).v(from);
        result.b[row](to) = s.b(i).v(from);
        result.c[row](to) = s.c(i).v(from);
        result.lag_b[row](to) = jet.lag_b(i).v(from);
      }
      result.d(to) = s.d.v(from);
      result.lag_d(to) = jet.lag_d.v(from);
      result.decay(to) = jet.decay.v(from);
      result.past_d(to) = jet.past_d.v(from);
    }
    if (!dry) return result;
    const auto jet_parts = parts_of(jets.data());
    for (std::size_t p = 0; p < active.size(); ++p) {
      const int from = active[p];
      if (from >= kCount) continue;
      const auto to = static_cast<Eigen::Index>(p);
      for (std::size_t part = 0; part < kFrictionParts; ++part) {
        for (int i = 0; i < kStates; ++i)
          result.parts_b[part][static_cast<std::size_t>(i)](to) = jet_parts.b[part](i).v(from);
        result.parts_d[part](to) = jet_parts.d[part].v(from);
        result.parts_past_d[part](to) = jet_parts.past_d[part].v(from);
      }
    }
  }
  return result;
}

/// Controller run on a value and its slopes at once.
template <int Columns>
class Controller {
 public:
  Controller(const data::TransferFunction& c, const double* start, std::span<const int> active)
      : law_(c), state_(law_.order() + 1, 0.0), slopes_(state_.size(), zero<Columns>()) {
    for (std::size_t i = 0; i + 1 < state_.size(); ++i) {
      state_[i] = start[i];
      for (std::size_t p = 0; p < active.size(); ++p)
        if (active[p] == kControllerState + static_cast<int>(i))
          slopes_[i](static_cast<Eigen::Index>(p)) = 1.0;
    }
  }

  double step(double e) { return law_.step(e, state_); }
  Slopes<Columns> step_slopes(const Slopes<Columns>& e) { return law_.step(e, slopes_); }

 private:
  ControllerLaw law_;
  std::vector<double> state_;
  std::vector<Slopes<Columns>> slopes_;
};

/// Friction over one sample of a driven side that would go from `velocity` to `free` without it, the torque
/// on it being even: it slides to the end, or up to a standstill, from where it rests or, pulled by more than
/// there is of friction, slides back.
void slide_or_stick(double velocity, double free, double velocity_gain, double coulomb, double& direction,
                    double& stuck) {
  direction = stuck = 0.0;
  const double pull = (free - velocity) / velocity_gain;
  const bool rests = std::abs(pull) <= coulomb;
  const double way = velocity > 0.0 ? 1.0 : velocity < 0.0 ? -1.0 : pull > 0.0 ? 1.0 : -1.0;
  if (way * free > velocity_gain * coulomb || way * pull > coulomb) {
    direction = way;
  } else if (rests) {
    stuck = free / velocity_gain;
  } else {
    const double share = std::abs(velocity) / (velocity_gain * (coulomb - way * pull));
    direction = way * (2.0 * share - 1.0);
  }
}

/// Rows [J r] reduced to their triangular factor from time to time.
template <int Columns>
class Compressed {
 public:
  void add(const Slopes<Columns>& slopes, double residual) {
    rows_.row(used_).template head<Columns>() = -slopes.matrix();
    rows_(used_, Columns) = residual;
    if (++used_ == kRows) reduce();
  }
  Eigen::MatrixXd factor() {
    reduce();
    return rows_.template topRows<Columns + 1>();
  }

 private:
  static constexpr int kRows = 256;
  void reduce() {
    rows_.bottomRows(kRows - used_).setZero();
    linalg::qr_in_place(rows_);
    for (int j = 0; j <= Columns; ++j) rows_.col(j).tail(kRows - 1 - j).setZero();
    used_ = Columns + 1;
  }
  Eigen::MatrixXd rows_ = Eigen::MatrixXd::Zero(kRows, Columns + 1);
  int used_ = 0;
};

/// Further torques, and what those that do not act on the driven side do.
template <int Masses>
class Pushed {
 public:
  Pushed(const SimulationSetup& setup, const double* x, const std::vector<std::vector<double>>& torques)
      : torques_(torques) {
    continuous_ = continuous_drive<Masses>(setup.coordinates.parameters(x, Masses == 3));
    const auto p = setup.coordinates.parameters(x, Masses == 3);
    for (std::size_t m = 1; m < torques.size(); ++m) {
      auto system = continuous_;
      system.b.setZero();
      system.b(static_cast<Eigen::Index>(m)) =
          1.0 / (Masses == 3 && m == 1 ? p.middle_inertia : p.load_inertia);
      drives_[m] = sampled_drive<Masses>(system, setup.quantity, x[kDelay] + setup.known_delay_samples,
                                         setup.coordinates.sample_time_s, Lag::none, 0.0, setup.velocity);
    }
  }
  [[nodiscard]] bool on(std::size_t mass) const { return mass < torques_.size() && !torques_[mass].empty(); }
  [[nodiscard]] double output(std::size_t j) const {
    double sum = 0.0;
    for (std::size_t m = 1; m < torques_.size(); ++m)
      if (on(m))
        sum += drives_[m].system.d * torques_[m][j] +
               drives_[m].past_d * (torques_[m][j == 0 ? 0 : j - 1] - torques_[m][j]);
    return sum;
  }
  [[nodiscard]] double state(int i, std::size_t j) const {
    double sum = 0.0;
    for (std::size_t m = 1; m < torques_.size(); ++m)
      if (on(m)) sum += drives_[m].system.b(i) * torques_[m][j];
    return sum;
  }
  template <class State>
  void record(const State& state, double torque, DriveMotion& motion) const {
    motion.velocity.resize(Masses);
    motion.twist.resize(Masses - 1);
    for (std::size_t m = 0; m < Masses; ++m) motion.velocity[m].push_back(state[m]);
    for (std::size_t c = 0; c + 1 < Masses; ++c)  // the states hold it scaled
      motion.twist[c].push_back(state[Masses + c] /
                                continuous_.a(static_cast<int>(Masses + c), static_cast<int>(c)));
    motion.torque.push_back(torque);
  }

 private:
  const std::vector<std::vector<double>>& torques_;
  LinearSystem<double, Sizes<Masses>::kStates> continuous_;
  std::array<SampledDrive<Masses, double>, Masses> drives_;
};

}  // namespace

DriveSignals whitened(const DriveSignals& raw, const NoiseModel& noise) {
  if (noise.order() == 0) return raw;
  DriveSignals s;
  s.input = whiten(raw.input, noise);
  s.reference = whiten(raw.reference, noise);
  s.output = whiten(raw.output, noise);
  s.direction = whiten(raw.direction, noise);
  s.stuck = whiten(raw.stuck, noise);
  for (std::size_t part = 0; part < kFrictionParts; ++part) {
    s.direction_parts[part] = whiten(raw.direction_parts[part], noise);
    s.stuck_parts[part] = whiten(raw.stuck_parts[part], noise);
  }
  s.unused = touched(raw.unused, noise);
  s.constant = std::accumulate(noise.polynomial.begin(), noise.polynomial.end(), 0.0);
  return s;
}

std::vector<double> friction_of(const DriveSignals& s, double coulomb) {
  std::vector<double> torque;
  torque.reserve(kFrictionParts * s.stuck.size());
  for (std::size_t k = 0; k < s.stuck.size(); ++k)
    for (std::size_t part = 0; part < kFrictionParts; ++part) {
      const bool even = s.stuck_parts[part].empty();
      torque.push_back(coulomb * (s.direction[k] + (even ? 0.0 : s.direction_parts[part][k])) + s.stuck[k] +
                       (even ? 0.0 : s.stuck_parts[part][k]));
    }
  return torque;
}

void take_friction(std::span<const double> torque, DriveSignals& s) {
  const std::size_t samples = torque.size() / kFrictionParts;
  s.stuck.assign(samples, 0.0);
  s.stuck_parts.fill(s.stuck);
  for (std::size_t k = 0; k < samples; ++k) {
    for (std::size_t part = 0; part < kFrictionParts; ++part)
      s.stuck[k] += torque[kFrictionParts * k + part] / kFrictionParts;
    for (std::size_t part = 0; part < kFrictionParts; ++part)
      s.stuck_parts[part][k] = torque[kFrictionParts * k + part] - s.stuck[k];
  }
}

int SimulationSetup::controller_order() const {
  if (!controller) return 0;
  return static_cast<int>(std::max(controller->numerator.size(), controller->denominator.size())) - 1;
}

template <int Masses, int Columns, class Sink>
void DriveSimulation::run(const double* x, std::span<const int> active, Sink&& sink, DriveSignals* friction,
                          DriveMotion* motion) const {
  constexpr int kOrder = Sizes<Masses>::kOrder;
  constexpr bool kSlopes = Columns > 0;
  using Row = Slopes<Columns>;
  const bool dry = !signals_.direction.empty();
  const bool given = !dry && !signals_.stuck.empty();
  const bool in_parts = friction != nullptr || ((dry || given) && !signals_.stuck_parts.front().empty());
  const auto model = sampled<Masses, Columns>(setup_, x, active, in_parts);
  const auto& s = model.drive.system;
  const bool lagging = setup_.lag == Lag::first_order;
  const bool grounded = setup_.grounded;
  const int used = kOrder + (grounded || setup_.quantity == data::OutputQuantity::position ? 1 : 0);
  const bool closed = setup_.controller.has_value();
  const Pushed<Masses> pushed(setup_, x, signals_.pushes);
  std::array<double, kOrder + 1> state;
  std::array<Row, kOrder + 1> slopes;
  for (int i = 0; i <= kOrder; ++i) {
    const int from = i < kOrder ? kInitialState + i : kPlace;
    state[static_cast<std::size_t>(i)] = x[from];
    slopes[static_cast<std::size_t>(i)] = zero<Columns>();
    if constexpr (kSlopes)
      for (std::size_t p = 0; p < active.size(); ++p)
        if (active[p] == from) slopes[static_cast<std::size_t>(i)](static_cast<Eigen::Index>(p)) = 1.0;
  }
  Row by_offset = zero<Columns>(), by_coulomb = zero<Columns>();
  if constexpr (kSlopes)
    for (std::size_t p = 0; p < active.size(); ++p) {
      if (active[p] == kOffset) by_offset(static_cast<Eigen::Index>(p)) = signals_.constant;
      if (active[p] == kCoulomb) by_coulomb(static_cast<Eigen::Index>(p)) = -1.0;
    }
  const auto first = static_cast<std::size_t>(model.drive.whole_delay + 1);
  std::vector<double> late_output(signals_.output.begin(),
                                  signals_.output.begin() + static_cast<std::ptrdiff_t>(closed ? first : 0));
  std::vector<Row> late_slopes(kSlopes && closed ? first : 0, zero<Columns>());
  std::optional<Controller<Columns>> controller;
  if (closed) controller.emplace(*setup_.controller, x + kControllerState, active);
  const double constant = x[kOffset] * signals_.constant, coulomb = std::max(0.0, x[kCoulomb]);
  const bool differences =
      setup_.velocity == Velocity::differences && setup_.quantity == data::OutputQuantity::velocity;
  double last_torque = 0.0;
  Row last_torque_slopes = zero<Columns>();
  std::array<double, kFrictionParts> last_beyond{}, last_direction_beyond{};
  double behind = x[kBehind], last_command = 0.0;  // by how much the torque loop lags behind its command
  Row behind_slopes = zero<Columns>(), last_slopes = zero<Columns>();
  if constexpr (kSlopes)
    for (std::size_t p = 0; p < active.size(); ++p)
      if (active[p] == kBehind) behind_slopes(static_cast<Eigen::Index>(p)) = 1.0;
  // The filter of the measured output holds what was recorded before.
  const double pole = x[kOutputFilter];
  double filtered = signals_.output[first > 0 ? first - 1 : 0];
  Row filtered_slopes = zero<Columns>(), by_pole = zero<Columns>();
  if constexpr (kSlopes)
    for (std::size_t p = 0; p < active.size(); ++p)
      if (active[p] == kOutputFilter) by_pole(static_cast<Eigen::Index>(p)) = 1.0;
  const bool filters = pole > 0.0 || std::find(active.begin(), active.end(), kOutputFilter) != active.end();
  for (std::size_t k = first; k < signals_.output.size(); ++k) {
    const std::size_t j = k - first;
    double command = signals_.input[j];
    Row command_slopes = zero<Columns>();
    if (closed) {
      command += controller->step(signals_.reference[j] - late_output[j % first]);
      if constexpr (kSlopes) command_slopes = controller->step_slopes(-late_slopes[j % first]);
    }
    double torque = constant + command;
    Row torque_slopes = by_offset + command_slopes;
    if (lagging) {
      if constexpr (kSlopes)
        if (j > 0)
          behind_slopes =
              last_slopes + model.drive.decay * behind_slopes + behind * model.decay - command_slopes;
      if (j > 0) behind = last_command + model.drive.decay * behind - command;
      last_command = command;
      if constexpr (kSlopes) last_slopes = command_slopes;
    }
    // Friction torque of the sample's parts beyond its mean, and the direction's.
    std::array<double, kFrictionParts> beyond{}, direction_beyond{};
    if (friction != nullptr) {
      std::array<double, kFrictionParts> direction{}, stuck{};
      auto inner = state;
      double still_behind = behind;
      for (std::size_t part = 0; part < kFrictionParts; ++part) {
        const auto& step = model.parts.step;
        const auto moved = [&](int row, double by) {
          double sum = step.b(row) * by;
          for (int c = 0; c < used; ++c) sum += step.a(row, c) * inner[static_cast<std::size_t>(c)];
          if (lagging) sum += model.parts.lag_b(row) * still_behind;
          return sum;
        };
        slide_or_stick(inner[0], moved(0, torque), step.b(0), coulomb, direction[part], stuck[part]);
        auto next = inner;
        for (int i = 0; i < used; ++i)
          next[static_cast<std::size_t>(i)] = moved(i, torque - x[kCoulomb] * direction[part] - stuck[part]);
        inner = next;
        still_behind *= model.parts.decay;
      }
      friction->direction[j] = std::accumulate(direction.begin(), direction.end(), 0.0) / kFrictionParts;
      friction->stuck[j] = std::accumulate(stuck.begin(), stuck.end(), 0.0) / kFrictionParts;
      for (std::size_t part = 0; part < kFrictionParts; ++part) {
        friction->direction_parts[part][j] = direction[part] - friction->direction[j];
        friction->stuck_parts[part][j] = stuck[part] - friction->stuck[j];
        beyond[part] = x[kCoulomb] * friction->direction_parts[part][j] + friction->stuck_parts[part][j];
      }
      torque -= x[kCoulomb] * friction->direction[j] + friction->stuck[j];
    } else if (dry) {
      torque -= x[kCoulomb] * signals_.direction[j] + signals_.stuck[j];
      if constexpr (kSlopes) torque_slopes += by_coulomb * signals_.direction[j];
      for (std::size_t part = 0; in_parts && part < kFrictionParts; ++part) {
        direction_beyond[part] = signals_.direction_parts[part][j];
        beyond[part] = x[kCoulomb] * direction_beyond[part] + signals_.stuck_parts[part][j];
      }
    } else if (given) {
      torque -= signals_.stuck[j];
      for (std::size_t part = 0; in_parts && part < kFrictionParts; ++part)
        beyond[part] = signals_.stuck_parts[part][j];
    }
    if (pushed.on(0)) torque += signals_.pushes[0][j];
    if (motion != nullptr) pushed.record(state, torque + behind, *motion);
    double output = s.d * torque + pushed.output(j);
    Row output_slopes = zero<Columns>();
    if constexpr (kSlopes) output_slopes = s.d * torque_slopes + model.d * torque;
    if (lagging) {
      output += model.drive.lag_d * behind;
      if constexpr (kSlopes) output_slopes += model.drive.lag_d * behind_slopes + model.lag_d * behind;
    }
    if (differences) {
      if (j == 0) {
        last_torque = torque;
        last_torque_slopes = torque_slopes;
      }
      output += model.drive.past_d * (last_torque - torque);
      if constexpr (kSlopes)
        output_slopes +=
            model.drive.past_d * (last_torque_slopes - torque_slopes) + model.past_d * (last_torque - torque);
      last_torque = torque;
      last_torque_slopes = torque_slopes;
    }
    for (int i = 0; i < used; ++i) {
      const auto at = static_cast<std::size_t>(i);
      output += s.c(i) * state[at];
      if constexpr (kSlopes) output_slopes += s.c(i) * slopes[at] + model.c[at] * state[at];
    }
    for (std::size_t part = 0; in_parts && part < kFrictionParts; ++part) {
      const double d = model.parts.d[part], past_d = model.parts.past_d[part];
      output -= d * beyond[part] + past_d * last_beyond[part];
      if constexpr (kSlopes)
        output_slopes += by_coulomb * (d * direction_beyond[part] + past_d * last_direction_beyond[part]) -
                         model.parts_d[part] * beyond[part] - model.parts_past_d[part] * last_beyond[part];
    }
    last_beyond = beyond;
    last_direction_beyond = direction_beyond;
    if (filters) {
      if constexpr (kSlopes)
        output_slopes = pole * filtered_slopes + (1.0 - pole) * output_slopes + (filtered - output) * by_pole;
      output = pole * filtered + (1.0 - pole) * output;
      filtered = output;
      filtered_slopes = output_slopes;
    }
    if (signals_.unused.empty() || !signals_.unused[k]) sink(signals_.output[k] - output, output_slopes);
    if (closed) {
      late_output[j % first] = output;
      if constexpr (kSlopes) late_slopes[j % first] = output_slopes;
    }
    const auto past = state;
    decltype(slopes) past_slopes{};
    if constexpr (kSlopes) past_slopes = slopes;
    for (int i = 0; i < used; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const bool by_place = grounded || i == kOrder;
      double sum = s.b(i) * torque;
      if (by_place) sum += s.a(i, kOrder) * past[kOrder];
      if (lagging) sum += model.drive.lag_b(i) * behind;
      for (int c = 0; c < kOrder; ++c) sum += s.a(i, c) * past[static_cast<std::size_t>(c)];
      for (std::size_t part = 0; in_parts && part < kFrictionParts; ++part)
        sum -= model.parts.b[part](i) * beyond[part];
      sum += pushed.state(i, j);
      state[at] = sum;
      if constexpr (kSlopes) {
        Row row = s.b(i) * torque_slopes + model.b[at] * torque;
        if (by_place) row += s.a(i, kOrder) * past_slopes[kOrder] + model.a[at][kOrder] * past[kOrder];
        if (lagging) row += model.drive.lag_b(i) * behind_slopes + model.lag_b[at] * behind;
        for (std::size_t c = 0; c < kOrder; ++c)
          row += s.a(i, static_cast<int>(c)) * past_slopes[c] + model.a[at][c] * past[c];
        for (std::size_t part = 0; in_parts && part < kFrictionParts; ++part)
          row += by_coulomb * (model.parts.b[part](i) * direction_beyond[part]) -
                 model.parts_b[part][at] * beyond[part];
        slopes[at] = row;
      }
    }
  }
}

std::vector<double> DriveSimulation::residual(std::span<const double> x) const {
  std::vector<double> left;
  left.reserve(signals_.output.size());
  with_masses(setup_.structure, [&](auto masses) {
    run<masses, 0>(
        x.data(), {}, [&](double r, const auto&) { left.push_back(r); }, nullptr);
  });
  return left;
}

double DriveSimulation::sum_of_squares(std::span<const double> x) const {
  double sum = 0.0;
  with_masses(setup_.structure, [&](auto masses) {
    run<masses, 0>(
        x.data(), {}, [&](double r, const auto&) { sum += r * r; }, nullptr);
  });
  return sum;
}

constexpr std::size_t kFew = 8, kSome = 12, kMany = 18, kMost = DriveSimulation::kMostColumns;

Eigen::Index DriveSimulation::factor_rows(std::size_t active) {
  return 1 + static_cast<Eigen::Index>(active <= kFew    ? kFew
                                       : active <= kSome ? kSome
                                       : active <= kMany ? kMany
                                                         : kMost);
}

Eigen::MatrixXd DriveSimulation::factor(std::span<const double> x, std::span<const int> active) const {
  return std::move(factors(x, active, 1).front().first);
}

std::vector<std::pair<Eigen::MatrixXd, std::size_t>> DriveSimulation::factors(std::span<const double> x,
                                                                              std::span<const int> active,
                                                                              std::size_t stretches) const {
  using Factors = std::vector<std::pair<Eigen::MatrixXd, std::size_t>>;
  const auto count = static_cast<Eigen::Index>(active.size());
  const auto unused =
      static_cast<std::size_t>(std::count(signals_.unused.begin(), signals_.unused.end(), true));
  const std::size_t length = (signals_.output.size() - unused + stretches - 1) / stretches;
  return with_masses(setup_.structure, [&](auto masses) -> Factors {
    const auto with = [&](auto columns) -> Factors {
      Factors found;
      Compressed<columns> compressed;
      std::size_t rows = 0;
      const auto close = [&] {
        const Eigen::MatrixXd whole = compressed.factor();
        Eigen::MatrixXd used(whole.rows(), count + 1);
        used.leftCols(count) = whole.leftCols(count);
        used.col(count) = whole.col(columns);
        found.emplace_back(std::move(used), rows);
        rows = 0;
      };
      run<masses, columns>(
          x.data(), active,
          [&](double r, const Slopes<columns>& slopes) {
            if (rows == length) {
              close();
              compressed = {};
            }
            compressed.add(slopes, r);
            ++rows;
          },
          nullptr);
      close();
      return found;
    };
    if (active.size() <= kFew) return with(std::integral_constant<int, kFew>());
    if (active.size() <= kSome) return with(std::integral_constant<int, kSome>());
    if (active.size() <= kMany) return with(std::integral_constant<int, kMany>());
    return with(std::integral_constant<int, kMost>());
  });
}

DriveMotion DriveSimulation::motion(std::span<const double> x) const {
  DriveMotion motion;
  with_masses(setup_.structure, [&](auto masses) {
    run<masses, 0>(
        x.data(), {}, [](double, const auto&) {}, nullptr, &motion);
  });
  return motion;
}

std::vector<double> DriveSimulation::moved_by(std::vector<std::vector<double>> pushes,
                                              std::span<const double> x) const {
  DriveSignals still;
  still.output.assign(signals_.output.size(), 0.0);
  still.input = still.output;
  if (setup_.controller) still.reference = still.output;
  still.unused = signals_.unused;
  still.pushes = std::move(pushes);
  std::vector<double> resting(x.begin(), x.end());
  std::fill(resting.begin() + kInitialState, resting.end(), 0.0);
  auto output = DriveSimulation(setup_, still).residual(resting);
  for (double& y : output) y = -y;
  return output;
}

Eigen::MatrixXd DriveSimulation::rows(std::span<const double> x, std::span<const int> active) const {
  const auto count = static_cast<Eigen::Index>(active.size());
  Eigen::MatrixXd found(static_cast<Eigen::Index>(signals_.output.size()), count + 1);
  Eigen::Index row = 0;
  with_masses(setup_.structure, [&](auto masses) {
    const auto with = [&](auto columns) {
      run<masses, columns>(
          x.data(), active,
          [&](double r, const Slopes<columns>& slopes) {
            found.row(row).head(count) = -slopes.matrix().head(count);
            found(row++, count) = r;
          },
          nullptr);
    };
    if (active.size() <= kFew)
      with(std::integral_constant<int, kFew>());
    else if (active.size() <= kSome)
      with(std::integral_constant<int, kSome>());
    else if (active.size() <= kMany)
      with(std::integral_constant<int, kMany>());
    else
      with(std::integral_constant<int, kMost>());
  });
  found.conservativeResize(row, Eigen::NoChange);
  return found;
}

DriveSignals DriveSimulation::friction(std::span<const double> x) const {
  DriveSignals course;
  simulate_friction(x, course);
  return course;
}

std::vector<double> DriveSimulation::moving_residual(std::span<const double> x) const {
  DriveSignals course;
  return simulate_friction(x, course);
}

std::vector<double> DriveSimulation::simulate_friction(std::span<const double> x,
                                                       DriveSignals& course) const {
  course.direction.assign(signals_.output.size(), 0.0);
  course.stuck = course.direction;
  course.direction_parts.fill(course.direction);
  course.stuck_parts.fill(course.direction);
  std::vector<double> left;
  left.reserve(signals_.output.size());
  with_masses(setup_.structure, [&](auto masses) {
    run<masses, 0>(
        x.data(), {}, [&](double r, const auto&) { left.push_back(r); }, &course);
  });
  return left;
}

}  // namespace resonid::fit::detail
