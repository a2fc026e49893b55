// SPDX-License-Identifier: MIT
#include "identify_many.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <resonid/identification/batch.hpp>
#include <resonid/identification/detail/cross_validation.hpp>
#include <resonid/report/detail/batch.hpp>
#include <resonid/report/json.hpp>
#include <set>

#include "brief.hpp"
#include "errors.hpp"
#include "inherit.hpp"
#include "option_names.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "provenance.hpp"
#include "result_file.hpp"
#include "result_words.hpp"
#include "terminal.hpp"

namespace resonid::cli {
namespace {

namespace fs = std::filesystem;
using identification::BatchEntry;

bool is_record(const fs::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension == ".csv" || extension == ".mat";
}

/// Each record by itself may be one realisation only; best-linear then is how they are joined.
bool pools_realisations(const IdentifyOptions& o) {
  return o.join && o.method.options.method == identification::Method::best_linear;
}

/// Reads a file and the options that go with it, on any thread.
expected<identification::BatchJob, Error> load(const CLI::App& verb, const IdentifyOptions& o,
                                               const std::string& file) {
  try {
    RecordOptions options = o.record;
    options.record = file;
    identification::BatchJob job{read_record(verb, options), {}};
    MethodOptions method = o.method;
    complete(method, job.record);
    job.options = std::move(method.options);
    job.options.jobs = 1;  // the cores are shared by the records already
    if (pools_realisations(o)) job.options.method = identification::Method::automatic;
    return job;
  } catch (const std::exception& error) {
    return tl::unexpected(Error{"", std::string(error.what())});
  }
}

/// The joint estimate of what could be identified.
void join(const CLI::App& verb, const IdentifyOptions& o, const std::vector<std::string>& files,
          Progress& progress, report::BatchResult& result) {
  std::vector<data::Record> records;
  std::vector<identification::Result> results;
  std::optional<identification::Options> options;
  for (std::size_t i = 0; i < files.size(); ++i) {
    const auto& entry = result.batch.entries[i];
    if (!entry.result) continue;
    progress.stage("joining, " + files[i]);
    auto job = load(verb, o, files[i]);
    if (!job) continue;  // it was there a moment ago; its row stands
    if (!options) options = job->options;
    if (pools_realisations(o)) options->method = identification::Method::best_linear;
    records.push_back(std::move(job->record));
    results.push_back(*entry.result);
  }
  if (records.size() < 2) {
    result.join_error =
        fmt::format("{} of the recordings could be identified, at least 2 are required", records.size());
    return;
  }
  options->jobs = o.jobs;
  options->progress = [&progress](std::string_view stage) {
    progress.stage(fmt::format("joining, {}", stage));
  };
  auto joint = identification::join(records, results, *options);
  if (!joint) throw UsageError(in_options(joint.error()));
  result.joint = std::move(*joint);
}

void validate_all(const CLI::App& verb, const IdentifyOptions& o, report::BatchResult& result) {
  for (auto& entry : result.batch.entries)
    if (entry.result) validate_elsewhere(verb, o, *entry.result);
  if (result.joint) validate_elsewhere(verb, o, result.joint->result);
}

void write_all(const IdentifyOptions& o, const std::vector<std::string>& files,
               const report::BatchResult& result) {
  if (!o.response.empty() && result.joint) write_response(o.response, result.joint->result);
  if (o.report.empty() && o.json.empty()) return;
  auto inputs = files;
  inputs.push_back(o.validate_on);
  const auto provenance = provenance_of_files(inputs);
  if (!o.report.empty()) {
    auto page = report::document(result);
    page.provenance = provenance;
    write_output(o.report, report::document_page(page));
  }
  if (o.json.empty()) return;
  auto json = report::to_json(result);
  report::put_provenance(json, provenance);
  write_json(o.json, json);
}

std::string brief_of(const report::BatchResult& result) {
  const auto* joint = result.joint ? &result.joint->result : nullptr;
  return brief_text(
      joint == nullptr ? "No joint estimate." : "Joint estimate: " + trusted_text(joint->trusted),
      report::document(result).summary,
      joint == nullptr ? std::vector<diagnostics::Finding>{} : joint->findings);
}

/// What went wrong, after everything else has been written.
void complain(const IdentifyOptions& o, const report::BatchResult& result) {
  std::string broken;
  std::size_t count = 0;
  bool trusted = !result.joint || result.joint->result.trusted;
  for (const BatchEntry& e : result.batch.entries) {
    if (e.result) {
      trusted = trusted && e.result->trusted;
      continue;
    }
    ++count;
    broken += "\n  " + report::error_line(e);
  }
  if (count > 0)
    throw InputError(fmt::format("{} of {} recordings could not be identified:{}", count,
                                 result.batch.entries.size(), broken));
  if (!result.join_error.empty()) throw InputError("--join: " + result.join_error);
  if (o.require_trusted && !trusted)
    throw NotTrustedError("not every result is reliable; the findings say why");
}

}  // namespace

std::vector<std::string> expanded(const std::vector<std::string>& arguments) {
  std::vector<std::string> files;
  for (const auto& argument : arguments) {
    std::error_code ignored;
    if (!fs::is_directory(argument, ignored)) {
      files.push_back(argument);
      continue;
    }
    std::vector<std::string> inside;
    for (const auto& entry : fs::directory_iterator(argument, ignored))
      if (entry.is_regular_file(ignored) && is_record(entry.path())) inside.push_back(entry.path().string());
    if (inside.empty()) throw InputError(argument + ": the folder holds no .csv and no .mat file");
    std::sort(inside.begin(), inside.end());
    files.insert(files.end(), inside.begin(), inside.end());
  }
  // A record beside the folder that holds it would count twice.
  std::set<fs::path> seen;
  std::erase_if(files, [&](const std::string& file) {
    std::error_code unreadable;
    const auto path = fs::weakly_canonical(file, unreadable);
    return !unreadable && !seen.insert(path).second;
  });
  return files;
}

void validate_elsewhere(const CLI::App& verb, const IdentifyOptions& o, identification::Result& result) {
  if (o.validate_on.empty() || !(result.model || result.black_box)) return;
  IdentifyOptions other = o;
  other.record.columns.second_output = {};  // the other record need not have one
  other.record.columns.second_output_kind = data::SecondOutput::none;
  auto job = load(verb, other, o.validate_on);
  if (!job) throw InputError("--validate-on: " + in_options(job.error()));
  const auto done = identification::validate_on(job->record, job->options, result);
  if (!done) throw UsageError("--validate-on: " + o.validate_on + ": " + in_options(done.error()));
}

void identify_many(const CLI::App& verb, const IdentifyOptions& o, const std::vector<std::string>& files) {
  if (!o.response.empty() && !o.join)
    throw UsageError(
        fmt::format("--response: holds one response, and there are {} recordings; required a single "
                    "recording, or --join for the averaged one (--json holds all)",
                    files.size()));
  const bool quiet = no_summary({{"--report", o.report}, {"--json", o.json}, {"--response", o.response}});
  std::vector<std::string_view> inputs(files.begin(), files.end());
  refuse_shared_files(inputs, {{"--report", o.report}, {"--json", o.json}, {"--response", o.response}});
  refuse_unwritable({o.report, o.json, o.response});
  Progress progress;
  progress.stage(fmt::format("identifying {} recordings", files.size()));
  identification::BatchTask task;
  task.files = files;
  task.jobs = o.jobs;
  task.load = [&](std::size_t i) { return load(verb, o, files[i]); };
  task.progress = [&](std::size_t done, const BatchEntry& entry) {
    progress.stage(fmt::format("{} of {} recordings done, {}{}", done, files.size(), entry.file,
                               entry.result ? "" : ": failed"));
  };
  report::BatchResult result;
  result.batch = identification::identify_batch(task);
  if (std::none_of(result.batch.entries.begin(), result.batch.entries.end(),
                   [](const BatchEntry& e) { return e.result.has_value(); }))
    complain(o, result);
  if (o.join) join(verb, o, files, progress, result);
  if (!o.validate_on.empty()) validate_all(verb, o, result);
  put_in_options(result);
  for (auto& entry : result.batch.entries)
    if (entry.result) entry.result->options = given_options(verb);
  if (result.joint) result.joint->result.options = given_options(verb);
  progress.stage("writing");
  write_all(o, files, result);
  if (!quiet) {
    print_summary(output_settings().brief ? brief_of(result)
                                          : report::summary_text(result, characters_of_text()));
    if (!o.report.empty()) print(fmt::format("Report written to {}\n", o.report));
  }
  complain(o, result);
}

}  // namespace resonid::cli
