// SPDX-License-Identifier: MIT
#pragma once

#include <ceres/jet.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <fit/drive/lanes.hpp>
#include <fit/drive/sampled_drive.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/data/detail/second_output.hpp>
#include <span>
#include <vector>

namespace resonid::fit::detail {

/// What a record or a response gives beside the parameters.
struct ResponseSetting {
  double sample_time_s = 0.0;
  double known_delay_samples = 0.0;
  Lag lag = Lag::none;
  bool grounded = false;
  Velocity velocity = Velocity::sampled;
  /// The response is that of the load, as such an output shows it: no filter, and the velocity from what it
  /// measures.
  data::SecondOutput second_output = data::SecondOutput::none;
  bool load_velocity = false;  ///< The response is that of the load's velocity itself.

  [[nodiscard]] bool at_load() const noexcept {
    return load_velocity || second_output != data::SecondOutput::none;
  }
};

/// Torque to delayed velocity, times exp(j w known delay): what is measured once the known delay is taken
/// out.
///
/// For delays of whole samples that is the velocity's response turned by the rest of the delay. A fraction of
/// a sample is seen through the hold, which near the Nyquist frequency is more than a turn. A negative delay
/// says that the input was measured, without a zero-order hold; then it is a turn and no more.
template <int Masses>
class MeasuredResponse {
 public:
  static constexpr int kStates = Sizes<Masses>::kStates;
  static constexpr int kParameters = Sizes<Masses>::kParameters;
  using Complex = std::complex<double>;

  MeasuredResponse(const data::ThreeMass<double>& p, double fitted_delay_samples, double lag_samples,
                   double filter_pole, const ResponseSetting& setting)
      : setting_(setting),
        filter_pole_(setting.at_load() ? 0.0 : filter_pole),
        order_(setting.grounded || setting.second_output == data::SecondOutput::load_encoder ? kStates
                                                                                             : kStates - 1) {
    const double delay = place(fitted_delay_samples);
    drive_ = sampled(p, delay, lag_samples);
  }

  /// From the fit's coordinates, to be differentiated by those that are `active`.
  MeasuredResponse(const Coordinates& coordinates, const double* x, const ResponseSetting& setting,
                   std::span<const int> active)
      : MeasuredResponse(coordinates.parameters(x, Masses == 3), x[kDelay], x[kTorqueLag], x[kOutputFilter],
                         setting) {
    if (active.empty()) return;
    using Jet = ceres::Jet<double, kParameters>;
    std::array<Jet, kParameters> jets;
    for (int i = 0; i < kParameters; ++i) jets[static_cast<std::size_t>(i)] = Jet(x[i]);
    for (const int p : active) jets[static_cast<std::size_t>(p)].v(p) = 1.0;
    const Jet delay = turn_samples_ < 0.0 ? Jet(0.0) : jets[kDelay] + Jet(setting.known_delay_samples);
    const auto s = sampled(coordinates.parameters(jets.data(), Masses == 3), delay, jets[kTorqueLag]);
    for (const int p : active) {
      Slope slope;
      for (int i = 0; i < kStates; ++i) {
        for (int j = 0; j < kStates; ++j) slope.a(i, j) = s.system.a(i, j).v(p);
        slope.b(i) = s.system.b(i).v(p);
        slope.c(i) = s.system.c(i).v(p);
        slope.lag_b(i) = s.lag_b(i).v(p);
      }
      slope.d = s.system.d.v(p);
      slope.lag_d = s.lag_d.v(p);
      slope.decay = s.decay.v(p);
      slope.past_d = s.past_d.v(p);
      slope.turn = p == kDelay && turn_samples_ < 0.0 ? 1.0 : 0.0;
      slope.filter = p == kOutputFilter && !setting.at_load() ? 1.0 : 0.0;
      slopes_.push_back(slope);
    }
  }

  /// At any number of frequencies.
  [[nodiscard]] std::vector<Complex> values(std::span<const double> frequencies_hz) const {
    std::vector<Complex> found;
    for (const auto& some : abscissae_of(frequencies_hz, setting_.sample_time_s)) {
      const ComplexLanes g = evaluate(some, {});
      for (int l = 0; l < kLanes && found.size() < frequencies_hz.size(); ++l) found.push_back(g.at(l));
    }
    return found;
  }

  /// At some frequencies side by side, and the derivatives by the active coordinates.
  [[nodiscard]] ComplexLanes evaluate(const Abscissa& where, std::span<ComplexLanes> derivatives) const {
    return order_ == kStates ? of_order<kStates>(where, derivatives)
                             : of_order<kStates - 1>(where, derivatives);
  }

 private:
  /// Of a known order the loops are unrolled.
  template <int Order>
  [[nodiscard]] ComplexLanes of_order(const Abscissa& where, std::span<ComplexLanes> derivatives) const {
    const ComplexLanes& step = where.step;
    const ComplexLanes lag_pole = inverse(step + 1.0 - drive_.decay);
    const ComplexLanes lagging = product(-step, lag_pole);  // e over u
    std::array<std::array<ComplexLanes, kStates>, kStates> m;
    std::array<ComplexLanes, kStates> x;
    for (int i = 0; i < Order; ++i) {
      for (int j = 0; j < Order; ++j) m[at(i)][at(j)] = -drive_.system.a(i, j);
      m[at(i)][at(i)] += 1.0 + step;
      x[at(i)] = drive_.system.b(i) + lagging * drive_.lag_b(i);
    }
    std::array<ComplexLanes, kStates> pivots;  // inverse; zI - A is far from singular ones off the poles
    for (int i = 0; i < Order; ++i) {
      pivots[at(i)] = inverse(m[at(i)][at(i)]);
      for (int r = i + 1; r < Order; ++r) {
        const ComplexLanes factor = product(m[at(r)][at(i)], pivots[at(i)]);
        m[at(r)][at(i)] = factor;
        for (int c = i + 1; c < Order; ++c) m[at(r)][at(c)] -= product(factor, m[at(i)][at(c)]);
        x[at(r)] -= product(factor, x[at(i)]);
      }
    }
    for (int i = Order - 1; i >= 0; --i) {
      for (int c = i + 1; c < Order; ++c) x[at(i)] -= product(m[at(i)][at(c)], x[at(c)]);
      x[at(i)] = product(x[at(i)], pivots[at(i)]);
    }
    const ComplexLanes past = product(-step, inverse(step + 1.0));  // u one sample ago, less u, over u
    ComplexLanes sum = drive_.system.d + lagging * drive_.lag_d + past * drive_.past_d;
    for (int i = 0; i < Order; ++i) sum += drive_.system.c(i) * x[at(i)];
    // F = (1 - p) z/(z - p), dF/dp = -z (z - 1)/(z - p)^2
    const ComplexLanes at_pole = inverse(step + 1.0 - filter_pole_);
    const ComplexLanes filtered = (1.0 - filter_pole_) * product(step + 1.0, at_pole);
    const ComplexLanes delayed = turned(where);
    const ComplexLanes turn = product(delayed, filtered);
    if (!derivatives.empty()) {
      const auto y = adjoint<Order>(m, pivots);
      const ComplexLanes lagging_slope = product(lagging, lag_pole);
      for (std::size_t p = 0; p < slopes_.size(); ++p) {
        const Slope& s = slopes_[p];
        ComplexLanes by =
            s.d + lagging * s.lag_d + lagging_slope * (s.decay * drive_.lag_d) + past * s.past_d;
        for (int i = 0; i < Order; ++i) {
          ComplexLanes row = s.b(i) + lagging * s.lag_b(i) + lagging_slope * (s.decay * drive_.lag_b(i));
          for (int j = 0; j < Order; ++j) row += s.a(i, j) * x[at(j)];
          by += product(y[at(i)], row) + s.c(i) * x[at(i)];
        }
        derivatives[p] = product(turn, by - product(ComplexLanes(Lanes::Zero(), s.turn * where.omega), sum));
        if (s.filter != 0.0)
          derivatives[p] -=
              product(product(delayed, sum), product(product(step + 1.0, step), product(at_pole, at_pole)));
      }
    }
    return product(turn, sum);
  }

  struct Slope {
    Eigen::Matrix<double, kStates, kStates> a;
    Eigen::Matrix<double, kStates, 1> b, c, lag_b;
    double d = 0.0, lag_d = 0.0, decay = 0.0, past_d = 0.0, turn = 0.0, filter = 0.0;
  };

  template <class T>
  [[nodiscard]] SampledDrive<Masses, T> sampled(const data::ThreeMass<T>& p, const T& delay,
                                                const T& lag_samples) const {
    return sampled_drive<Masses>(p, data::quantity_of(setting_.second_output), delay, setting_.sample_time_s,
                                 setting_.lag, lag_samples,
                                 setting_.at_load() ? Velocity::sampled : setting_.velocity,
                                 setting_.at_load() ? Masses - 1 : 0);
  }

  static std::size_t at(int i) { return static_cast<std::size_t>(i); }

  /// By the delay that is not in the sampled drive, and by what the second output measures.
  [[nodiscard]] ComplexLanes turned(const Abscissa& where) const {
    const double delay = setting_.known_delay_samples - drive_.whole_delay - 1 - turn_samples_;
    ComplexLanes turn;
    for (int l = 0; l < kLanes; ++l)
      turn.set(l, std::polar(1.0, delay * where.omega(l)) *
                      data::load_velocity_factor(setting_.second_output, where.frequency_hz(l),
                                                 setting_.sample_time_s));
    return turn;
  }

  double place(double fitted_delay_samples) {
    const double delay = fitted_delay_samples + setting_.known_delay_samples;
    turn_samples_ = std::min(delay, 0.0);
    return std::max(delay, 0.0);
  }

  /// Solves (zI - A)' y = c' from the factors.
  template <int Order>
  std::array<ComplexLanes, kStates> adjoint(const std::array<std::array<ComplexLanes, kStates>, kStates>& m,
                                            const std::array<ComplexLanes, kStates>& pivots) const {
    std::array<ComplexLanes, kStates> y;
    for (int i = 0; i < Order; ++i) {
      y[at(i)] = drive_.system.c(i);
      for (int c = 0; c < i; ++c) y[at(i)] -= product(m[at(c)][at(i)], y[at(c)]);
      y[at(i)] = product(y[at(i)], pivots[at(i)]);
    }
    for (int i = Order - 1; i >= 0; --i)
      for (int r = i + 1; r < Order; ++r) y[at(i)] -= product(m[at(r)][at(i)], y[at(r)]);
    return y;
  }

  ResponseSetting setting_;
  double filter_pole_ = 0.0;
  int order_ = 0;
  double turn_samples_ = 0.0;
  SampledDrive<Masses, double> drive_;
  std::vector<Slope> slopes_;
};

}  // namespace resonid::fit::detail
