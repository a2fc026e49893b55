// SPDX-License-Identifier: MIT
#include <nlohmann/json.hpp>
#include <resonid/io/detail/atomic_file.hpp>
#include <resonid/io/experiment.hpp>
#include <resonid/report/detail/compare.hpp>
#include <resonid/report/detail/plan.hpp>
#include <resonid/report/detail/track.hpp>
#include <resonid/report/detail/validate.hpp>
#include <resonid/report/json.hpp>
#include <resonid/report/page.hpp>
#include <resonid/resonid.hpp>

namespace resonid {
namespace {

/// The library's error, with the file that it is about.
template <class Found>
Error in_file(const Found& found, const std::filesystem::path& file) {
  if constexpr (std::is_same_v<Found, Error>) {
    Error error = found;
    if (error.where.empty()) error.where = file.string();
    return error;
  } else {
    return {"file", found.message, std::numeric_limits<double>::quiet_NaN(), file.string()};
  }
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
  auto simulation = plant::simulate_closed_loop(options);
  if (!simulation) return unexpected(Error{simulation.error().field, simulation.error().requirement});
  return std::move(*simulation);
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

expected<std::filesystem::path, Error> write_report(const std::filesystem::path& file, const Result& result,
                                                    const Record& record) {
  return write(file, report::page(report::page_json(result, record)));
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

std::string to_json(const Result& result) { return report::to_json(result).dump(1); }
std::string to_json(const Track& track) { return report::track_json(track).dump(1); }
std::string to_json(const ModelValidation& validation) { return report::to_json(validation).dump(1); }
std::string to_json(const Changes& changes) { return report::to_json(changes).dump(1); }
std::string to_json(const Plan& plan) { return report::to_json(plan).dump(1); }

template <>
expected<Result, Error> from_json<Result>(std::string_view text) {
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (json.is_discarded()) return refuse("text", "must be JSON");
  auto result = report::result_from_json(json);
  if (!result) return unexpected(Error{"text", result.error().message()});
  return std::move(*result);
}

}  // namespace resonid
