// SPDX-License-Identifier: MIT
#include <nlohmann/json.hpp>
#include <resonid/io/detail/atomic_file.hpp>
#include <resonid/io/experiment.hpp>
#include <resonid/report/detail/batch.hpp>
#include <resonid/report/detail/compare.hpp>
#include <resonid/report/detail/page.hpp>
#include <resonid/report/detail/plan.hpp>
#include <resonid/report/detail/track.hpp>
#include <resonid/report/detail/truth.hpp>
#include <resonid/report/detail/tune.hpp>
#include <resonid/report/detail/validate.hpp>
#include <resonid/report/json.hpp>
#include <resonid/resonid.hpp>

namespace resonid {
namespace {

/// The library's error, with the file that it is about.
Error in_file(Error error, const std::filesystem::path& file) {
  if (error.where.empty()) error.where = file.string();
  return error;
}

template <class T>
expected<T, Error> read(std::string_view text) {
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (json.is_discarded()) return refuse("text", "must be JSON");
  return report::from_json<T>(json);
}

expected<std::filesystem::path, Error> write(const std::filesystem::path& file, const std::string& page) {
  auto written = io::write_file_atomically(file, page);
  if (!written) return unexpected(in_file(written.error(), file));
  return file;
}

}  // namespace

expected<Record, Error> read_record(const std::filesystem::path& file, const ReadOptions& options) {
  auto record = io::read_record(file, options);
  if (!record) return unexpected(in_file(record.error(), file));
  return std::move(*record);
}

expected<SimulateOptions, Error> read_experiment(const std::filesystem::path& file) {
  auto config = io::read_experiment(file);
  if (!config) return unexpected(in_file(config.error(), file));
  return std::move(*config);
}

expected<Simulation, Error> simulate(const SimulateOptions& options) {
  return plant::simulate_closed_loop(options);
}

expected<Plan, Error> plan(const PlanOptions& options) { return planning::make_plan(options); }

expected<Plan, Error> plan(const Result& identified, PlanOptions options) {
  if (!identified.model) return refuse("model", "must be a drive's: the result has none");
  auto& drive = options.drive;
  drive.model = identified.model->drive;
  drive.model.known_delay_s += drive.model.delay_s;
  drive.model.delay_s = 0.0;
  if (identified.validation && identified.validation->residual_rms) {
    const double rms = *identified.validation->residual_rms;
    drive.noise = {};
    drive.noise.innovation_variance = rms * rms;
  }
  return planning::make_plan(options);
}

expected<std::string, Error> controller_json(const Tuning& tuning) {
  const auto json = report::controller_json(tuning);
  if (!json) return unexpected(json.error());
  return json->dump(2) + "\n";
}
std::string controller_json(const FirstLoop& loop) {
  return report::controller_json(loop.controller).dump(2) + "\n";
}

expected<std::filesystem::path, Error> write_report(const std::filesystem::path& file, const Result& result,
                                                    const Record& record) {
  return write(file, report::page(report::page_json(result, record)));
}
expected<std::filesystem::path, Error> write_report(const std::filesystem::path& file, const Batch& batch) {
  return write(file, report::document_page(report::document(report::BatchResult{batch, {}, {}})));
}
expected<std::filesystem::path, Error> write_report(const std::filesystem::path& file, const Batch& batch,
                                                    const Joint& joint) {
  return write(file, report::document_page(report::document(report::BatchResult{batch, joint, {}})));
}
expected<std::filesystem::path, Error> write_report(const std::filesystem::path& file,
                                                    const ModelValidation& validation, const Record& record) {
  return write(file, report::document_page(report::document(validation, record)));
}
expected<std::filesystem::path, Error> write_report(const std::filesystem::path& file, const Track& track) {
  return write(file, report::document_page(report::track_document(track)));
}
expected<std::filesystem::path, Error> write_report(const std::filesystem::path& file,
                                                    const Changes& changes) {
  return write(file, report::document_page(report::document(changes)));
}
expected<std::filesystem::path, Error> write_report(const std::filesystem::path& file, const Plan& plan) {
  return write(file, report::document_page(report::document(plan)));
}
expected<std::filesystem::path, Error> write_report(const std::filesystem::path& file, const Tuning& tuning) {
  return write(file, report::document_page(report::document(tuning)));
}
expected<std::filesystem::path, Error> write_report(const std::filesystem::path& file,
                                                    const Simulation& simulation) {
  return write(file, report::document_page(report::document(simulation)));
}

std::string to_json(const Result& result) { return report::to_json(result).dump(1); }
std::string to_json(const Batch& batch) {
  return report::to_json(report::BatchResult{batch, {}, {}}).dump(1);
}
std::string to_json(const Batch& batch, const Joint& joint) {
  return report::to_json(report::BatchResult{batch, joint, {}}).dump(1);
}
std::string to_json(const Track& track) { return report::to_json(track).dump(1); }
std::string to_json(const ModelValidation& validation) { return report::to_json(validation).dump(1); }
std::string to_json(const Changes& changes) { return report::to_json(changes).dump(1); }
std::string to_json(const Plan& plan) { return report::to_json(plan).dump(1); }
std::string to_json(const Tuning& tuning) { return report::to_json(tuning).dump(1); }

std::string to_json(const Truth& truth) { return report::to_json(report::simulated_truth(truth)).dump(1); }

template <>
expected<Result, Error> from_json<Result>(std::string_view text) {
  return read<Result>(text);
}
template <>
expected<Batch, Error> from_json<Batch>(std::string_view text) {
  auto result = read<report::BatchResult>(text);
  if (!result) return unexpected(std::move(result.error()));
  return std::move(result->batch);
}
template <>
expected<Joint, Error> from_json<Joint>(std::string_view text) {
  auto result = read<report::BatchResult>(text);
  if (!result) return unexpected(std::move(result.error()));
  if (!result->joint)
    return refuse("$.joint", "must hold a joint estimate: these recordings were not joined");
  return std::move(*result->joint);
}
template <>
expected<Track, Error> from_json<Track>(std::string_view text) {
  return read<Track>(text);
}
template <>
expected<ModelValidation, Error> from_json<ModelValidation>(std::string_view text) {
  return read<ModelValidation>(text);
}
template <>
expected<Changes, Error> from_json<Changes>(std::string_view text) {
  return read<Changes>(text);
}
template <>
expected<Plan, Error> from_json<Plan>(std::string_view text) {
  return read<Plan>(text);
}
template <>
expected<Tuning, Error> from_json<Tuning>(std::string_view text) {
  return read<Tuning>(text);
}
template <>
expected<Truth, Error> from_json<Truth>(std::string_view text) {
  auto truth = read<report::SimulatedTruth>(text);
  if (!truth) return unexpected(std::move(truth.error()));
  return std::move(truth->truth);
}

}  // namespace resonid
