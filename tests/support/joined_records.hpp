// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Cholesky>
#include <cmath>
#include <drive_bound.hpp>
#include <resonid/base/error_text.hpp>
#include <resonid/identification/join.hpp>
#include <string>
#include <vector>

// Records of one drive that are to be joined, and what their joint estimate is held against.
namespace resonid::test {

/// Simulated records with the bound that they set together.
struct JoinedRecords {
  std::vector<plant::ExperimentConfig> experiments;
  std::vector<data::Record> records;
  identification::Options options;
  std::vector<identification::Result> results;

  void add(const plant::ExperimentConfig& c, data::Record record) {
    record.source = "r" + std::to_string(records.size() + 1);
    experiments.push_back(c);
    records.push_back(std::move(record));
  }
  void add(const plant::ExperimentConfig& c) { add(c, simulated(c).record); }
  identification::Joint joined() {
    for (const auto& record : records) results.push_back(identified(record, options));
    auto joint = identification::join(records, results, options);
    if (!joint) throw std::runtime_error(message_of(joint.error()));
    return std::move(*joint);
  }
  /// Cramer-Rao bound of the logarithms of J1, J2, K, D.
  [[nodiscard]] Eigen::Matrix4d bound() const {
    Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
    for (std::size_t i = 0; i < records.size(); ++i)
      information += fisher_information_of_logarithms(experiments[i], records[i]);
    return information.inverse();
  }
  [[nodiscard]] Eigen::Matrix4d bound_of(std::size_t i) const {
    return fisher_information_of_logarithms(experiments[i], records[i]).inverse();
  }
};

/// Covariance of the logarithms of J1, J2, K, D that a model states, and its error in them.
inline Eigen::Matrix4d logarithmic_covariance(const fit::DriveModel& model) {
  Eigen::Vector4d scale;
  for (int i = 0; i < 4; ++i) scale(i) = 1.0 / model.value(static_cast<fit::Parameter>(i));
  return scale.asDiagonal() * model.covariance.topLeftCorner<4, 4>() * scale.asDiagonal();
}
inline Eigen::Vector4d logarithmic_error(const fit::DriveModel& model, const plant::ExperimentConfig& c) {
  const Eigen::Vector4d truth = drive_parameters(c);
  Eigen::Vector4d error;
  for (int i = 0; i < 4; ++i) error(i) = std::log(model.value(static_cast<fit::Parameter>(i)) / truth(i));
  return error;
}
/// Normalised estimation error squared: chi-square of four degrees of freedom if the covariance is right.
inline double normalised_error(const fit::DriveModel& model, const plant::ExperimentConfig& c) {
  const Eigen::Vector4d e = logarithmic_error(model, c);
  return e.dot(logarithmic_covariance(model).ldlt().solve(e));
}

/// Four multisines of 6 s, each over another narrow band of the published drive: none holds both the
/// inertia's slope and the resonance.
inline JoinedRecords narrow_bands(std::uint64_t seed, double noise = 0.1) {
  JoinedRecords bench;
  const std::vector<std::vector<double>> bands = {
      {2.0, 2.5, 3.0, 3.5, 4.0}, {8.0, 8.5, 9.0, 9.5, 10.0}, {16.0, 16.5, 17.0, 17.5}, {24.0, 25.0, 26.0}};
  for (const auto& band : bands) {
    auto c = published_drive(noise, 10.0, 10 * seed + bench.records.size());
    c.excitation.kind = online::Kind::multisine;
    c.excitation.lines_hz.assign(band);
    c.excitation.amplitude = 0.2;
    c.run.duration_s = 6.0;
    bench.add(c);
    bench.options = known(c);
  }
  return bench;
}

/// Four short records of a PRBS cut out of the running machine.
inline JoinedRecords short_records(std::uint64_t seed, double length_s = 0.5, double noise = 0.1) {
  JoinedRecords bench;
  for (int i = 0; i < 4; ++i) {
    auto c = published_drive(noise, 10.0, 10 * seed + bench.records.size());
    prbs(c);
    const double from_s = 0.4 + 0.3 * i, to_s = from_s + length_s;
    c.run.duration_s = to_s;
    bench.options = known(c);
    bench.add(c, cut_from(simulated(c).record, from_s));
  }
  return bench;
}

}  // namespace resonid::test
