// SPDX-License-Identifier: MIT
#include <algorithm>
#include <fit/drive/measured_response.hpp>
#include <resonid/fit/detail/sampled_states.hpp>

namespace resonid::fit {
namespace {

template <int Masses>
SampledStates states_of(const DriveModel& model) {
  using detail::Sizes;
  const double step = model.sample_time_s;
  const double delay = std::max(0.0, model.delay_s + model.known_delay_s) / step;
  const auto lag = model.torque_lag_s > 0.0 ? detail::Lag::first_order : detail::Lag::none;
  const auto continuous = detail::continuous_drive<Masses>(model.parameters);
  auto pushed = continuous;  // by a torque on the load
  pushed.b.setZero();
  pushed.b(Masses - 1) =
      1.0 / (Masses == 1 ? model.parameters.driven_inertia : model.parameters.load_inertia);
  constexpr auto kVelocity = data::OutputQuantity::velocity;
  const auto drive = detail::sampled_drive<Masses>(continuous, kVelocity, delay, step, lag,
                                                   model.torque_lag_s / step, model.velocity);
  const auto push =
      detail::sampled_drive<Masses>(pushed, kVelocity, delay, step, detail::Lag::none, 0.0, model.velocity);
  const double pole = detail::filter_pole(model.output_filter_s, step);

  // The place counts between springs only. Then: the lagging torque, both torques of the sample before, and
  // the measured velocities that are on their way, of which the newest is the filter's state too.
  const int motion = model.grounded() ? Sizes<Masses>::kStates : Sizes<Masses>::kOrder;
  const int lagging = motion, command_before = motion + 1, push_before = motion + 2, late = motion + 3;
  const int size = late + drive.whole_delay + 1;
  SampledStates s{Eigen::MatrixXd::Zero(size, size),
                  Eigen::VectorXd::Zero(size),
                  Eigen::VectorXd::Zero(size),
                  Eigen::RowVectorXd::Zero(size),
                  Eigen::RowVectorXd::Zero(size),
                  step,
                  motion,
                  drive.whole_delay};
  for (int i = 0; i < motion; ++i) {
    for (int j = 0; j < motion; ++j) s.a(i, j) = drive.system.a(i, j);
    s.a(i, lagging) = drive.lag_b(i);
    s.command(i) = drive.system.b(i) - drive.lag_b(i);
    s.load_torque(i) = push.system.b(i);
    s.a(late, i) = (1.0 - pole) * drive.system.c(i);
  }
  s.a(lagging, lagging) = drive.decay;
  s.command(lagging) = 1.0 - drive.decay;
  s.command(command_before) = 1.0;
  s.load_torque(push_before) = 1.0;
  s.a(late, late) = pole;
  s.a(late, lagging) = (1.0 - pole) * drive.lag_d;
  s.a(late, command_before) = (1.0 - pole) * drive.past_d;
  s.a(late, push_before) = (1.0 - pole) * push.past_d;
  s.command(late) = (1.0 - pole) * (drive.system.d - drive.lag_d - drive.past_d);
  s.load_torque(late) = (1.0 - pole) * (push.system.d - push.past_d);
  for (int i = late + 1; i < size; ++i) s.a(i, i - 1) = 1.0;
  s.measured(size - 1) = 1.0;
  s.load(Masses - 1) = 1.0;
  return s;
}

}  // namespace

SampledStates sampled_states(const DriveModel& model) {
  return detail::with_masses(model.structure, [&](auto masses) { return states_of<masses>(model); });
}

template <int Masses>
struct SampledResponse::OfMasses : SampledResponse::Base {
  explicit OfMasses(const DriveModel& m)
      : delay_s(std::max(0.0, m.delay_s + m.known_delay_s)),
        setting(setting_of(m)),
        measured(m.parameters, delay_s / m.sample_time_s, m.torque_lag_s / m.sample_time_s,
                 detail::filter_pole(m.output_filter_s, m.sample_time_s), setting),
        load(m.parameters, 0.0, m.torque_lag_s / m.sample_time_s, 0.0, of_load(setting)) {}

  [[nodiscard]] std::vector<Value> at(std::span<const double> frequencies_hz) const override {
    std::vector<Value> values;
    values.reserve(frequencies_hz.size());
    for (const auto& some : detail::abscissae_of(frequencies_hz, setting.sample_time_s)) {
      const auto y = measured.evaluate(some, {}), v = load.evaluate(some, {});
      for (int l = 0; l < detail::kLanes && values.size() < frequencies_hz.size(); ++l)
        values.push_back({y.at(l), v.at(l)});
    }
    return values;
  }

  static detail::ResponseSetting setting_of(const DriveModel& m) {
    detail::ResponseSetting s;
    s.sample_time_s = m.sample_time_s;
    s.lag = m.torque_lag_s > 0.0 ? detail::Lag::first_order : detail::Lag::none;
    s.grounded = m.grounded();
    s.velocity = m.velocity;
    return s;
  }
  static detail::ResponseSetting of_load(detail::ResponseSetting s) {
    s.load_velocity = true;
    return s;
  }

  double delay_s;
  detail::ResponseSetting setting;
  detail::MeasuredResponse<Masses> measured, load;
};

SampledResponse::SampledResponse(const DriveModel& model) {
  detail::with_masses(model.structure,
                      [&](auto masses) { of_ = std::make_shared<const OfMasses<masses>>(model); });
}

}  // namespace resonid::fit
