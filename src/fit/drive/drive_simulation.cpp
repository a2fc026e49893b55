// SPDX-License-Identifier: MIT
#include <algorithm>
#include <fit/controller_law.hpp>
#include <fit/drive/drive_simulation.hpp>
#include <fit/drive/sampled_slopes.hpp>
#include <fit/drive/slopes.hpp>
#include <numeric>
#include <utility>

#include "linalg/decompositions.hpp"

namespace resonid::fit::detail {
namespace {

#ifdef __x86_64__
#define RESONID_WIDE [[gnu::target("avx2")]]
constexpr bool kMayBeWide = true;
bool is_wide() { return __builtin_cpu_supports("avx2") != 0; }
#else
#define RESONID_WIDE
constexpr bool kMayBeWide = false;
[[maybe_unused]] bool is_wide() { return false; }
#endif

/// Controller run on a value and its slopes at once.
template <class Row>
class Controller {
 public:
  Controller(const data::TransferFunction& c, const double* start, std::span<const int> active)
      : law_(c), state_(law_.order() + 1, 0.0), slopes_(state_.size()) {
    for (std::size_t i = 0; i + 1 < state_.size(); ++i) {
      state_[i] = start[i];
      for (std::size_t p = 0; p < active.size(); ++p)
        if (active[p] == kControllerState + static_cast<int>(i))
          slopes_[i].set(static_cast<Eigen::Index>(p), 1.0);
    }
  }

  double step(double e) { return law_.step(e, state_); }
  Row step_slopes(const Row& e) { return law_.step(e, slopes_); }

 private:
  ControllerLaw law_;
  std::vector<double> state_;
  std::vector<Row> slopes_;
};

/// Rows [J r] as they come, to be reduced to their triangular factor some at a time.
class Rows {
 protected:
  static constexpr Eigen::Index kRows = 256;
  explicit Rows(Eigen::Index columns) : columns_(columns), rows_(Eigen::MatrixXd::Zero(kRows, columns + 1)) {}
  /// Whether there is no room for another.
  template <class Row>
  bool fill(const Row& slopes, double residual) {
    for (Eigen::Index p = 0; p < columns_; ++p) rows_(used_, p) = -slopes(p);
    rows_(used_, columns_) = residual;
    return ++used_ == kRows;
  }
  Eigen::Index columns_;
  Eigen::MatrixXd rows_;
  Eigen::Index used_ = 0;
};

/// By Householder's reflections.
class Reflected : Rows {
 public:
  explicit Reflected(Eigen::Index columns) : Rows(columns) {}
  template <class Row>
  void add(const Row& slopes, double residual) {
    if (fill(slopes, residual)) reduce();
  }
  /// Begins anew.
  std::optional<Eigen::MatrixXd> factor() {
    reduce();
    used_ = 0;
    return rows_.topRows(columns_ + 1);
  }

 private:
  void reduce() {
    rows_.bottomRows(kRows - used_).setZero();
    linalg::qr_in_place(rows_);
    for (Eigen::Index j = 0; j <= columns_; ++j) rows_.col(j).tail(kRows - 1 - j).setZero();
    used_ = columns_ + 1;
  }
};

/// By the Cholesky factor of their scalar products, in a third of the time: exact enough where no column is
/// nearly a combination of others. The residual's own column may be one: what is left of it then is nothing.
class Squared : Rows {
 public:
  explicit Squared(Eigen::Index columns)
      : Rows(columns), products_(Eigen::MatrixXd::Zero(columns + 1, columns + 1)) {}
  template <class Row>
  void add(const Row& slopes, double residual) {
    if (fill(slopes, residual)) reduce();
  }
  /// Begins anew. Nothing where rounding would show.
  std::optional<Eigen::MatrixXd> factor() {
    reduce();
    const Eigen::MatrixXd products =
        std::exchange(products_, Eigen::MatrixXd::Zero(products_.rows(), products_.cols()));
    Eigen::MatrixXd upper = Eigen::MatrixXd::Zero(products.rows(), products.cols());
    for (Eigen::Index i = 0; i <= columns_; ++i) {
      const double all = products(i, i);
      const double left = all - upper.col(i).head(i).squaredNorm();
      if (!std::isfinite(all)) return std::nullopt;  // an overflow must stay one
      constexpr double kIndependent = 1e-7;  // of a column's square: rounding then moves the factor by 1e-7
      if (i < columns_ && all > 0.0 && !(left > kIndependent * all)) return std::nullopt;
      upper(i, i) = std::sqrt(std::max(0.0, left));
      if (!(upper(i, i) > 0.0)) continue;
      for (Eigen::Index j = i + 1; j <= columns_; ++j)
        upper(i, j) = (products(j, i) - upper.col(i).head(i).dot(upper.col(j).head(i))) / upper(i, i);
    }
    return upper;
  }

 private:
  void reduce() {
    for (Eigen::Index i = 0; i <= columns_; ++i)
      for (Eigen::Index j = i; j <= columns_; ++j)
        products_(j, i) += rows_.col(i).head(used_).dot(rows_.col(j).head(used_));
    used_ = 0;
  }
  Eigen::MatrixXd products_;  ///< Lower triangle.
};

/// The course of dry friction as the drive itself moves.
template <int Masses>
class MovingFriction {
 public:
  static constexpr std::size_t kStates = Sizes<Masses>::kStates;
  using State = std::array<double, kStates>;
  using Parts = std::array<double, kFrictionParts>;

  /// `used`: states that count.
  template <class Model>
  MovingFriction(const SimulationSetup& setup, const double* x, const Model& model, int used, bool on_load)
      : driven_(model.driven.parts),
        load_(model.load.parts),
        law_{std::max(0.0, x[kCoulomb]), x[kExcess], x[kStribeckVelocity]},
        load_law_{x[kLoadCoulomb]},
        coulomb_(x[kCoulomb]),
        used_(used),
        lagging_(setup.lag == Lag::first_order),
        on_load_(on_load) {}

  /// Over one sample from `state` under `torque`, which lags `behind`.
  void advance(State state, double torque, double behind, Parts& direction, Parts& stuck, Parts& load) {
    const auto& step = driven_.step;
    constexpr std::size_t kLast = Masses - 1;
    for (std::size_t part = 0; part < kFrictionParts; ++part) {
      State next = state;
      for (int i = 0; i < used_; ++i) {
        double sum = step.b(i) * torque;
        for (int c = 0; c < used_; ++c) sum += step.a(i, c) * state[static_cast<std::size_t>(c)];
        if (lagging_) sum += driven_.lag_b(i) * behind;
        next[static_cast<std::size_t>(i)] = sum;
      }
      // The sides hardly reach each other within the part: the load's friction of the part before will do.
      const double across = on_load_ ? load_.step.b(0) * last_load_ : 0.0;
      const auto f = slide_or_stick(law_, state[0], next[0] - across, step.b(0));
      direction[part] = f.direction;
      stuck[part] = f.stuck;
      const double against = coulomb_ * f.direction + f.stuck;
      for (int i = 0; i < used_; ++i) next[static_cast<std::size_t>(i)] -= step.b(i) * against;
      if (on_load_) {
        const auto g = slide_or_stick(load_law_, state[kLast], next[kLast], load_.step.b(kLast));
        load[part] = last_load_ = load_law_.coulomb * g.direction + g.stuck;
        for (int i = 0; i < used_; ++i) next[static_cast<std::size_t>(i)] -= load_.step.b(i) * last_load_;
      }
      state = next;
      behind *= driven_.decay;
    }
  }

 private:
  const FrictionParts<Masses, double>& driven_;
  const FrictionParts<Masses, double>& load_;
  FrictionLaw law_, load_law_;
  double coulomb_;
  int used_;
  bool lagging_, on_load_;
  double last_load_ = 0.0;
};

/// Further torques, and what those that do not act on the driven side do.
template <int Masses>
class Pushed {
 public:
  Pushed(const SimulationSetup& setup, const double* x, const std::vector<std::vector<double>>& torques)
      : torques_(torques) {
    continuous_ = continuous_drive<Masses>(setup.coordinates.parameters(x, Masses == 3));
    const auto p = setup.coordinates.parameters(x, Masses == 3);
    for (std::size_t m = 1; m < std::min<std::size_t>(torques.size(), Masses); ++m) {
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
    for (std::size_t m = 1; m < Masses; ++m)
      if (on(m))
        sum += drives_[m].system.d * torques_[m][j] +
               drives_[m].past_d * (torques_[m][j == 0 ? 0 : j - 1] - torques_[m][j]);
    return sum;
  }
  [[nodiscard]] double state(int i, std::size_t j) const {
    double sum = 0.0;
    for (std::size_t m = 1; m < Masses; ++m)
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

int SimulationSetup::controller_order() const {
  if (!controller) return 0;
  return static_cast<int>(std::max(controller->numerator.size(), controller->denominator.size())) - 1;
}

template <int Masses, class Row, class Sink>
[[gnu::always_inline]] inline void DriveSimulation::run(const double* x, std::span<const int> active,
                                                        Sink&& sink, DriveSignals* friction,
                                                        DriveMotion* motion) const {
  constexpr int kOrder = Sizes<Masses>::kOrder;
  constexpr bool kSlopes = Row::kColumns > 0;
  const bool dry = !signals_.direction.empty();
  const bool given = !dry && !signals_.stuck.empty();
  const bool in_parts = friction != nullptr || ((dry || given) && !signals_.stuck_parts.front().empty());
  const bool on_load =
      Masses > 1 && (friction != nullptr ? x[kLoadCoulomb] > 0.0 : !signals_.on_load.front().empty());
  const auto model = sampled<Masses, Row>(setup_, x, active, {in_parts, on_load});
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
    if constexpr (kSlopes)
      for (std::size_t p = 0; p < active.size(); ++p)
        if (active[p] == from) slopes[static_cast<std::size_t>(i)].set(static_cast<Eigen::Index>(p), 1.0);
  }
  Row by_offset, by_coulomb;
  if constexpr (kSlopes)
    for (std::size_t p = 0; p < active.size(); ++p) {
      if (active[p] == kOffset) by_offset.set(static_cast<Eigen::Index>(p), signals_.constant);
      if (active[p] == kCoulomb) by_coulomb.set(static_cast<Eigen::Index>(p), -1.0);
    }
  const auto first = static_cast<std::size_t>(model.drive.whole_delay + 1);
  std::vector<double> late_output(signals_.output.begin(),
                                  signals_.output.begin() + static_cast<std::ptrdiff_t>(closed ? first : 0));
  std::vector<Row> late_slopes(kSlopes && closed ? first : 0);
  std::optional<Controller<Row>> controller;
  if (closed) controller.emplace(*setup_.controller, x + kControllerState, active);
  const double constant = x[kOffset] * signals_.constant;
  const bool differences =
      setup_.velocity == Velocity::differences && setup_.quantity == data::OutputQuantity::velocity;
  double last_torque = 0.0;
  Row last_torque_slopes;
  std::array<double, kFrictionParts> last_beyond{}, last_direction_beyond{}, last_load{};
  MovingFriction<Masses> moving(setup_, x, model, used, on_load);
  double behind = x[kBehind], last_command = 0.0;  // by how much the torque loop lags behind its command
  Row behind_slopes, last_slopes;
  if constexpr (kSlopes)
    for (std::size_t p = 0; p < active.size(); ++p)
      if (active[p] == kBehind) behind_slopes.set(static_cast<Eigen::Index>(p), 1.0);
  // The filter of the measured output holds what was recorded before.
  const double pole = x[kOutputFilter];
  double filtered = signals_.output[first > 0 ? first - 1 : 0];
  Row filtered_slopes, by_pole;
  if constexpr (kSlopes)
    for (std::size_t p = 0; p < active.size(); ++p)
      if (active[p] == kOutputFilter) by_pole.set(static_cast<Eigen::Index>(p), 1.0);
  const bool filters = pole > 0.0 || std::find(active.begin(), active.end(), kOutputFilter) != active.end();
  for (std::size_t k = first; k < signals_.output.size(); ++k) {
    const std::size_t j = k - first;
    double command = signals_.input[j];
    Row command_slopes;
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
    // Friction torque of the sample's parts beyond its mean, and the direction's; all of it on the load.
    std::array<double, kFrictionParts> beyond{}, direction_beyond{}, load{};
    if (friction != nullptr) {
      std::array<double, kFrictionParts> direction{}, stuck{};
      moving.advance(state, torque, lagging ? behind : 0.0, direction, stuck, load);
      const double sides = std::accumulate(direction.begin(), direction.end(), 0.0) / kFrictionParts;
      const double rests = std::accumulate(stuck.begin(), stuck.end(), 0.0) / kFrictionParts;
      for (std::size_t part = 0; part < kFrictionParts; ++part)
        beyond[part] = x[kCoulomb] * (direction[part] - sides) + (stuck[part] - rests);
      torque -= x[kCoulomb] * sides + rests;
      if (!friction->direction.empty()) {  // it is asked for
        friction->direction[j] = sides;
        friction->stuck[j] = rests;
        for (std::size_t part = 0; part < kFrictionParts; ++part) {
          friction->direction_parts[part][j] = direction[part] - sides;
          friction->stuck_parts[part][j] = stuck[part] - rests;
          if (on_load) friction->on_load[part][j] = load[part];
        }
      }
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
    if (on_load && friction == nullptr)
      for (std::size_t part = 0; part < kFrictionParts; ++part) load[part] = signals_.on_load[part][j];
    if (pushed.on(0)) torque += signals_.pushes[0][j];
    if (motion != nullptr) pushed.record(state, torque + behind, *motion);
    double output = s.d * torque + pushed.output(j);
    Row output_slopes;
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
    const auto against = [&](const PartsSlopes<Masses, Row>& side, std::size_t part, double now,
                             double before) {
      output -= side.parts.d[part] * now + side.parts.past_d[part] * before;
      if constexpr (kSlopes) output_slopes -= side.d[part] * now + side.past_d[part] * before;
    };
    for (std::size_t part = 0; in_parts && part < kFrictionParts; ++part) {
      const double d = model.driven.parts.d[part], past_d = model.driven.parts.past_d[part];
      against(model.driven, part, beyond[part], last_beyond[part]);
      if constexpr (kSlopes)
        output_slopes += by_coulomb * (d * direction_beyond[part] + past_d * last_direction_beyond[part]);
    }
    if (j == 0) last_load = load;
    for (std::size_t part = 0; on_load && part < kFrictionParts; ++part)
      against(model.load, part, load[part], last_load[part]);
    last_load = load;
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
        sum -= model.driven.parts.b[part](i) * beyond[part];
      for (std::size_t part = 0; on_load && part < kFrictionParts; ++part)
        sum -= model.load.parts.b[part](i) * load[part];
      sum += pushed.state(i, j);
      state[at] = sum;
      if constexpr (kSlopes) {
        Row row = s.b(i) * torque_slopes + model.b[at] * torque;
        if (by_place) row += s.a(i, kOrder) * past_slopes[kOrder] + model.a[at][kOrder] * past[kOrder];
        if (lagging) row += model.drive.lag_b(i) * behind_slopes + model.lag_b[at] * behind;
        for (std::size_t c = 0; c < kOrder; ++c)
          row += s.a(i, static_cast<int>(c)) * past_slopes[c] + model.a[at][c] * past[c];
        for (std::size_t part = 0; in_parts && part < kFrictionParts; ++part)
          row += by_coulomb * (model.driven.parts.b[part](i) * direction_beyond[part]) -
                 model.driven.b[part][at] * beyond[part];
        for (std::size_t part = 0; on_load && part < kFrictionParts; ++part)
          row -= model.load.b[part][at] * load[part];
        slopes[at] = row;
      }
    }
  }
}

// The same for processors that add four doubles at once; to the last bit the same, since products and sums
// stay apart.
template <int Masses, class Row, class Sink>
RESONID_WIDE void DriveSimulation::run_wide(const double* x, std::span<const int> active, Sink&& sink) const {
  run<Masses, Row>(x, active, sink, nullptr);
}

template <int Masses, class Sink>
void DriveSimulation::run_with_slopes(const double* x, std::span<const int> active, Sink&& sink) const {
  const auto with = [&](auto columns) {
    if constexpr (kMayBeWide)
      if (is_wide()) return run_wide<Masses, Slopes<columns, 4>>(x, active, sink);
    run<Masses, Slopes<columns>>(x, active, sink, nullptr);
  };
  if (active.size() <= 8) return with(std::integral_constant<int, 8>());
  if (active.size() <= 12) return with(std::integral_constant<int, 12>());
  if (active.size() <= 18) return with(std::integral_constant<int, 18>());
  with(std::integral_constant<int, kMostColumns>());
}

std::vector<double> DriveSimulation::residual(std::span<const double> x) const {
  std::vector<double> left;
  left.reserve(signals_.output.size());
  with_masses(setup_.structure, [&](auto masses) {
    run<masses, Slopes<0>>(
        x.data(), {}, [&](double r, const auto&) { left.push_back(r); }, nullptr);
  });
  return left;
}

double DriveSimulation::sum_of_squares(std::span<const double> x) const {
  double sum = 0.0;
  with_masses(setup_.structure, [&](auto masses) {
    run<masses, Slopes<0>>(
        x.data(), {}, [&](double r, const auto&) { sum += r * r; }, nullptr);
  });
  return sum;
}

Eigen::MatrixXd DriveSimulation::factor(std::span<const double> x, std::span<const int> active) const {
  return std::move(factors(x, active, 1).front().first);
}

std::vector<std::pair<Eigen::MatrixXd, std::size_t>> DriveSimulation::factors(std::span<const double> x,
                                                                              std::span<const int> active,
                                                                              std::size_t stretches) const {
  auto found = factors_by<Squared>(x, active, stretches);
  if (found.empty()) found = factors_by<Reflected>(x, active, stretches);
  return found;
}

template <class Reduction>
std::vector<std::pair<Eigen::MatrixXd, std::size_t>> DriveSimulation::factors_by(
    std::span<const double> x, std::span<const int> active, std::size_t stretches) const {
  const auto unused =
      static_cast<std::size_t>(std::count(signals_.unused.begin(), signals_.unused.end(), true));
  const std::size_t length = (signals_.output.size() - unused + stretches - 1) / stretches;
  std::vector<std::pair<Eigen::MatrixXd, std::size_t>> found;
  Reduction reduction(static_cast<Eigen::Index>(active.size()));
  std::size_t rows = 0;
  bool all = true;
  const auto close = [&] {
    auto factor = reduction.factor();
    all = all && factor;
    if (all) found.emplace_back(std::move(*factor), std::exchange(rows, 0));
  };
  with_masses(setup_.structure, [&](auto masses) {
    run_with_slopes<masses>(x.data(), active, [&](double r, const auto& slopes) {
      if (rows == length) close();
      reduction.add(slopes, r);
      ++rows;
    });
  });
  close();
  if (!all) found.clear();
  return found;
}

DriveMotion DriveSimulation::motion(std::span<const double> x) const {
  DriveMotion motion;
  with_masses(setup_.structure, [&](auto masses) {
    run<masses, Slopes<0>>(
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
    run_with_slopes<masses>(x.data(), active, [&](double r, const auto& slopes) {
      for (Eigen::Index p = 0; p < count; ++p) found(row, p) = -slopes(p);
      found(row++, count) = r;
    });
  });
  found.conservativeResize(row, Eigen::NoChange);
  return found;
}

DriveSignals DriveSimulation::friction(std::span<const double> x) const {
  DriveSignals course;
  course.direction.assign(signals_.output.size(), 0.0);
  course.stuck = course.direction;
  course.direction_parts.fill(course.direction);
  course.stuck_parts.fill(course.direction);
  if (x[kLoadCoulomb] > 0.0) course.on_load.fill(course.direction);
  simulate_friction(x, course);
  return course;
}

std::vector<double> DriveSimulation::moving_residual(std::span<const double> x) const {
  DriveSignals course;
  return simulate_friction(x, course);
}

std::vector<double> DriveSimulation::simulate_friction(std::span<const double> x,
                                                       DriveSignals& course) const {
  std::vector<double> left;
  left.reserve(signals_.output.size());
  with_masses(setup_.structure, [&](auto masses) {
    run<masses, Slopes<0>>(
        x.data(), {}, [&](double r, const auto&) { left.push_back(r); }, &course);
  });
  return left;
}

}  // namespace resonid::fit::detail
