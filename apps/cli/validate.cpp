// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <array>
#include <cctype>
#include <memory>
#include <nlohmann/json.hpp>
#include <resonid/base/error_text.hpp>
#include <resonid/identification/validate.hpp>
#include <resonid/io/detail/json_file.hpp>
#include <resonid/report/detail/validate.hpp>

#include "brief.hpp"
#include "errors.hpp"
#include "help.hpp"
#include "inherit.hpp"
#include "option_names.hpp"
#include "options.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "provenance.hpp"
#include "record_options.hpp"
#include "result_words.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

namespace resonid::cli {
namespace {

struct ValidateVerb {
  std::string model;
  RecordOptions record;
  MethodOptions method;
  std::uint64_t max_lag = 25;
  std::optional<std::pair<double, double>> fit_band_hz;
  std::string report, json, residual;
  bool require_trusted = false;
};

identification::CandidateModel read_candidate(const std::string& path) {
  const auto json = io::read_json(path);
  if (!json) throw InputError(message_of(json.error()));
  auto candidate = report::from_json<identification::CandidateModel>(*json);
  if (!candidate)
    throw InputError(path +
                     ": holds neither a result of 'resonid identify --json' nor a transfer function\n" +
                     message_of(candidate.error()));
  candidate->source = path;
  return std::move(*candidate);
}

/// What the model's result stores of the machine, unless the file is a bare transfer function.
void inherit_from_model(CLI::App& verb, const ValidateVerb& o) {
  const auto json = io::read_json(o.model);
  if (!json) return;
  if (const auto result = report::from_json<identification::Result>(*json))
    inherit(verb, result->options, o.model, is_of_record(*result, o.record.record));
}

/// Whether the model's options cut the same stretch out of the file as those of this run.
bool is_own_stretch(const CLI::App& verb, const std::string& model) {
  const auto json = io::read_json(model);
  if (!json) return false;
  const auto result = report::from_json<identification::Result>(*json);
  if (!result) return false;
  constexpr std::array<std::string_view, 2> kEnds = {"from", "to"};
  return std::all_of(kEnds.begin(), kEnds.end(), [&](std::string_view end) {
    const auto stored = std::find_if(result->options.begin(), result->options.end(),
                                     [&](const auto& o) { return o.name == end; });
    const auto* now = verb.get_option(fmt::format("--{}", end));
    const std::string then = stored == result->options.end() ? std::string() : stored->value;
    return then == (now->count() > 0 ? now->results().front() : std::string());
  });
}

/// By the hashes of the files and what was cut out of them; not known of a result without hashes.
std::optional<bool> is_own_record(const CLI::App& verb, const std::string& model,
                                  const report::Provenance& now) {
  const auto json = io::read_json(model);
  const auto then = json ? report::provenance_of(*json) : std::nullopt;
  if (!then || then->files.empty() || now.files.empty()) return std::nullopt;
  const auto& record = now.files.back();
  if (record.sha256.empty()) return std::nullopt;
  return is_own_stretch(verb, model) &&
         std::any_of(then->files.begin(), then->files.end(),
                     [&](const auto& file) { return file.sha256 == record.sha256; });
}

std::string residual_csv(const identification::ModelValidation& v, const data::Record& record) {
  std::vector<double> time, output;
  for (std::size_t k = 0; k < v.residual.size(); ++k) {
    time.push_back(record.start_time_s + static_cast<double>(v.first_sample + k) / record.sample_rate_hz);
    output.push_back(record.output.samples[v.first_sample + k]);
  }
  return csv_text(
      {{"time_s", time}, {"output", output}, {"simulated", v.simulated}, {"residual", v.residual}});
}

std::string brief_of(const identification::ModelValidation& v) {
  std::string verdict(name_of(v.verdict));
  verdict[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(verdict[0])));
  return brief_text(verdict + (v.trusted ? "." : ". NOT trusted."), report::sentences(v), v.findings);
}

void run_validate(CLI::App& verb, ValidateVerb& o) {
  const bool quiet = no_summary({{"--report", o.report}, {"--json", o.json}, {"--residual", o.residual}});
  refuse_shared_files({o.model, o.record.record},
                      {{"--report", o.report}, {"--json", o.json}, {"--residual", o.residual}});
  inherit_from_model(verb, o);
  check(verb, o.method);
  if (o.fit_band_hz && !(o.fit_band_hz->first >= 0.0 && o.fit_band_hz->first < o.fit_band_hz->second))
    throw UsageError(fmt::format("--fit-band: found {:g}:{:g}, required 0 <= LO < HI", o.fit_band_hz->first,
                                 o.fit_band_hz->second));
  refuse_unwritable({o.report, o.json, o.residual});
  Progress progress;
  progress.stage("reading " + o.record.record);
  const auto candidate = read_candidate(o.model);
  const auto record = read_record(verb, o.record);
  complete(o.method, record);
  if (verb.get_option("--delay")->count() == 0) o.method.options.delay_s = candidate.known_delay_s;
  o.method.options.progress = [&progress](std::string_view stage) { progress.stage(stage); };
  progress.stage("simulating");
  const auto provenance = provenance_of_files({o.model, o.record.record});
  auto v = identification::validate(
      record, candidate,
      {o.method.options, o.max_lag, o.fit_band_hz, is_own_record(verb, o.model, provenance)});
  if (!v)
    throw UsageError(v.error().field == "candidate" ? o.model + ": " + v.error().requirement.str()
                                                    : in_options(v.error()));
  put_in_options(*v);
  if (!o.residual.empty()) write_output(o.residual, residual_csv(*v, record));
  if (!o.report.empty()) {
    auto page = report::document(*v, record);
    page.provenance = provenance;
    write_output(o.report, report::document_page(page));
  }
  if (!o.json.empty()) {
    auto json = report::to_json(*v);
    report::put_provenance(json, provenance);
    write_json(o.json, json);
  }
  if (!quiet) {
    print_summary(output_settings().brief ? brief_of(*v) : report::summary_text(*v));
    if (!o.report.empty()) print(fmt::format("Report written to {}\n", o.report));
  }
  if (o.require_trusted && !v->trusted)
    throw NotTrustedError("the model is not valid for this recording; the findings say why");
}

}  // namespace

void add_validate(CLI::App& app) {
  auto* verb = app.add_subcommand("validate", "Tests a model on a recording that it was not fitted to");
  verb->footer(
      "Examples:\n"
      "  resonid validate result.json tomorrow.csv --controller pi:1.036,0.147 --report validation.html\n"
      "  resonid validate result.json tomorrow.csv --controller pi:1.036,0.147 --approach indirect\n"
      "MODEL.json is what 'resonid identify ... --json FILE' writes, or {\"numerator\": [], \"denominator\": "
      "[], \"sample_time_s\": T} in powers of z^-1 from input to velocity. Columns, units, scales, "
      "controller and delay are those that the result stores unless given.");
  const auto o = std::make_shared<ValidateVerb>();
  verb->add_option("MODEL", o->model, "result of identify --json, or a transfer function")
      ->required()
      ->type_name("MODEL.json");
  add_record_options(*verb, o->record);
  add_excitation_options(*verb, o->method);
  add_loop_options(*verb, o->method);
  verb->option_defaults()->group("Tests");
  add_count(*verb, "--max-lag", o->max_lag, "correlations are shown for lags -N ... N", 1);
  add_colons(
      *verb, "--fit-band", 2, "LO:HI",
      [o](const std::vector<double>& v) {
        o->fit_band_hz = {v[0], v[1]};
      },
      "also give the fit within these frequencies, in Hz");
  add_summary_options(*verb);
  verb->add_option("--report", o->report, "self-contained HTML report")->type_name("FILE");
  verb->add_option("--json", o->json, "validation for machines ('-': standard output)")->type_name("FILE");
  verb->add_option("--residual", o->residual, "recorded and simulated output and their difference as CSV")
      ->type_name("FILE");
  verb->add_flag("--require-trusted", o->require_trusted,
                 "exit code 3 when the model is not valid for the recording");
  verb->callback([verb, o] { run_validate(*verb, *o); });
}

}  // namespace resonid::cli
