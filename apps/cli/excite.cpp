// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <resonid/online/excitation/excitation.hpp>
#include <resonid/planning/detail/crest_factor.hpp>

#include "errors.hpp"
#include "options.hpp"
#include "output.hpp"
#include "provenance.hpp"
#include "verbs.hpp"

namespace resonid::cli {
namespace {

using online::Excitation;
using online::Kind;

struct ExciteOptions {
  online::ExcitationConfig config;
  double sample_rate_hz = 0.0;
  std::uint64_t periods = 1;
  std::uint64_t realisations = 0;  // 0: not asked for
  std::vector<double> left_out_hz;
  double record_s = 0.0;   // --duration of the kinds that have no duration of their own
  bool optimised = false;  // --phases optimised
  std::string out;
  std::string json;
};

constexpr double kMaxSamples = 1e8;

/// The options of a kind's fields. Phases may be optimised here, where there is time for it; firmware takes
/// them as given.
class ExciteVisitor {
 public:
  ExciteVisitor(CLI::App& app, ExciteOptions& options) : app_(app), all_(app), options_(options) {}

  template <class Field>
  void operator()(std::string_view field, Field& target, std::string_view doc) {
    if (field == "phases")
      add_phases();
    else if (field == "phases_rad")
      add_phase_list(std::string(doc));
    else
      all_(field, target, doc);
  }

 private:
  void add_phases() {
    std::vector<std::string_view> names;
    for (const auto& known : online::enum_names(online::Phases{})) names.push_back(known.name);
    names.push_back("optimised");
    const auto assign = [&o = options_](std::size_t i) {
      o.optimised = i == static_cast<std::size_t>(online::Phases::given) + 1;
      o.config.phases = o.optimised ? online::Phases::given : static_cast<online::Phases>(i);
    };
    add_choice(app_, "--phases", names, assign,
               "schroeder, random, zero, given (by --phase-list), or optimised: the smallest crest factor")
        ->default_str("schroeder");
  }
  void add_phase_list(const std::string& doc) {
    add_lines(
        app_, "--phase-list",
        [&o = options_](std::span<const double> rad) {
          if (!o.config.phases_rad.assign(rad)) throw UsageError("--phase-list: holds too many phases");
        },
        doc);
  }

  CLI::App& app_;
  OptionVisitor all_;
  ExciteOptions& options_;
};

/// Phases of the smallest crest factor, as data.
void optimise(const CLI::App& verb, ExciteOptions& o) {
  auto& c = o.config;
  planning::PhaseConfig p;
  p.sample_rate_hz = o.sample_rate_hz;
  p.frequency_hz.assign(c.lines_hz.hz().begin(), c.lines_hz.hz().end());
  p.amplitude.assign(c.line_amplitudes.values().begin(), c.line_amplitudes.values().end());
  if (p.amplitude.empty()) p.amplitude = {1.0};
  p.seed = c.seed;
  const auto phases = planning::optimise_phases(p);
  if (!phases) refuse_option(verb, phases.error());
  c.phases_rad.assign(phases->phase_rad);
}

/// What leave_out leaves, and the rest for the report.
void leave_out_lines(const CLI::App& verb, ExciteOptions& o) {
  online::ExcitationConfig bare = o.config;  // phases come later where they are optimised
  if (o.optimised) bare.phases = online::Phases::schroeder;
  auto kept = online::with_kept_lines(bare, o.sample_rate_hz);
  if (!kept) refuse_option(verb, kept.error());
  const auto all = o.config.lines_hz.hz();
  const auto stay = kept->lines_hz.hz();
  std::set_difference(all.begin(), all.end(), stay.begin(), stay.end(), std::back_inserter(o.left_out_hz));
  kept->phases = o.config.phases;
  o.config = *kept;
}

void check_realisations(const CLI::App& verb, const ExciteOptions& o) {
  const auto& c = o.config;
  if (verb.count("--realisations") > 0 && c.periods_per_realisation == 0)
    throw UsageError("--realisations: --periods-per-realisation P is required with it, P >= 3");
  if (c.periods_per_realisation > 0 && c.phases != online::Phases::random)
    throw UsageError("--periods-per-realisation: new phases are drawn at random; required --phases random");
}

std::size_t length_of(const CLI::App& verb, const ExciteOptions& o, const Excitation& excitation) {
  if (o.record_s < 0.0) refuse_option(verb, {"duration_s", "must be > 0", o.record_s});
  if (o.periods < 1) refuse_option(verb, {"periods", "must be >= 1", 0.0});
  const auto natural = static_cast<double>(excitation.natural_length_samples());
  if (natural == 0.0 && o.record_s == 0.0)
    throw UsageError("--duration is required: these lines have no common period");
  const std::uint64_t periods =
      o.realisations > 0 ? o.realisations * o.config.periods_per_realisation : o.periods;
  const double samples =
      o.record_s > 0.0 ? o.record_s * o.sample_rate_hz : natural * static_cast<double>(periods);
  if (samples < 0.5 || samples > kMaxSamples)
    throw UsageError(
        fmt::format("--duration, --periods: {} samples are asked for, required 1 ... 1e8", samples));
  return static_cast<std::size_t>(std::llround(samples));
}

/// Whole passes begin anew; a length that was asked for, or realisations, just run on.
void fill(Excitation& excitation, const ExciteOptions& o, std::span<double> samples) {
  const bool runs_on = o.record_s > 0.0 || o.config.periods_per_realisation > 0;
  const std::size_t pass = runs_on ? samples.size() : excitation.natural_length_samples();
  for (std::size_t k = 0; k < samples.size(); k += pass) {
    excitation.reset();
    excitation.fill(samples.subspan(k, std::min(pass, samples.size() - k)));
  }
  excitation.reset();
}

/// Lines left out, and how often the phases change.
std::string multisine_text(const ExciteOptions& o, std::size_t period, std::size_t samples) {
  std::string text;
  if (!o.left_out_hz.empty()) {
    const double base_hz = o.sample_rate_hz / static_cast<double>(period);
    const auto even = std::count_if(o.left_out_hz.begin(), o.left_out_hz.end(),
                                    [&](double f) { return std::llround(f / base_hz) % 2 == 0; });
    text += fmt::format("  left out      {} of {} lines: {} even and {} odd multiples of {:.4g} Hz\n",
                        o.left_out_hz.size(), o.left_out_hz.size() + o.config.lines_hz.count, even,
                        static_cast<std::ptrdiff_t>(o.left_out_hz.size()) - even, base_hz);
  }
  if (const std::size_t each = o.config.periods_per_realisation * period; each > 0)
    text += fmt::format("  realisations  {} of {} periods\n", (samples + each - 1) / each,
                        o.config.periods_per_realisation);
  return text;
}

nlohmann::json lines_json(const Excitation& excitation) {
  nlohmann::json json = nlohmann::json::object();
  if (const auto* multisine = std::get_if<online::Multisine<online::kMaxLines>>(&excitation.generator()))
    for (std::size_t i = 0; i < multisine->lines(); ++i) {
      json["lines_hz"].push_back(multisine->frequency_hz(i));
      json["phases_rad"].push_back(multisine->phase_rad(i));
    }
  if (const auto* stepped = std::get_if<online::SteppedSine<online::kMaxLines>>(&excitation.generator()))
    for (std::size_t i = 0; i < stepped->lines(); ++i) json["lines_hz"].push_back(stepped->frequency_hz(i));
  return json;
}

void run_excite(const CLI::App& verb, ExciteOptions& o) {
  if (!(o.sample_rate_hz > 0.0)) refuse_option(verb, {"sample_rate_hz", "must be > 0", o.sample_rate_hz});
  if (o.config.kind == Kind::multisine) {
    check_realisations(verb, o);
    leave_out_lines(verb, o);
  }
  if (o.optimised) optimise(verb, o);
  auto excitation = Excitation::create(o.config, o.sample_rate_hz);
  if (!excitation) refuse_option(verb, excitation.error());
  const bool quiet = no_summary({{"--out", o.out}, {"--json", o.json}});
  refuse_unwritable({o.out, o.json});
  std::vector<double> samples(length_of(verb, o, *excitation));
  fill(*excitation, o, samples);
  std::vector<double> time(samples.size());
  for (std::size_t k = 0; k < time.size(); ++k) time[k] = static_cast<double>(k) / o.sample_rate_hz;

  const auto metrics = online::measure(samples);
  const auto band = excitation->band();
  const double duration = static_cast<double>(samples.size()) / o.sample_rate_hz;
  if (!o.out.empty()) write_output(o.out, csv_text({{"time_s", time}, {"excitation", samples}}));
  if (!o.json.empty()) {
    nlohmann::json json = lines_json(*excitation);
    json["schema"] = "resonid.excitation/1";
    json["kind"] = verb.get_name();
    json["samples"] = samples.size();
    json["sample_rate_hz"] = o.sample_rate_hz;
    json["duration_s"] = duration;
    if (excitation->period_samples() > 0) json["period_samples"] = excitation->period_samples();
    if (!o.left_out_hz.empty()) json["left_out_hz"] = o.left_out_hz;
    if (o.config.periods_per_realisation > 0)
      json["periods_per_realisation"] = o.config.periods_per_realisation;
    json["rms"] = metrics.rms;
    json["peak"] = metrics.peak;
    json["crest_factor"] = metrics.crest_factor;
    json["band_hz"] = {band.low_hz, band.high_hz};
    if (!o.out.empty() && o.out != "-") json["file"] = o.out;
    report::put_provenance(json, provenance_of_files({}));
    write_json(o.json, json);
  }
  if (quiet) return;
  std::string text = fmt::format("{}: {} samples at {:g} Hz, {:g} s\n", verb.get_name(), samples.size(),
                                 o.sample_rate_hz, duration);
  if (excitation->period_samples() > 0)
    text += fmt::format("  period        {} samples\n", excitation->period_samples());
  text += multisine_text(o, excitation->period_samples(), samples.size());
  text += fmt::format("  band          {:.4g} ... {:.4g} Hz\n", band.low_hz, band.high_hz);
  text += fmt::format("  rms           {:.4g}\n  peak          {:.4g}\n  crest factor  {:.4g}\n", metrics.rms,
                      metrics.peak, metrics.crest_factor);
  if (!o.out.empty()) text += fmt::format("  written to    {}\n", o.out);
  print_text(text);
}

void add_kind(CLI::App& excite, Kind kind, const std::string& doc, const std::string& example) {
  auto* verb = excite.add_subcommand(std::string(name_of(kind)), doc)->group("Kinds");
  verb->option_defaults()->group("Excitation");
  verb->footer("Example:\n  resonid excite " + example);
  const auto o = std::make_shared<ExciteOptions>();
  o->config.kind = kind;
  add_number(*verb, "--sample-rate", o->sample_rate_hz, "HZ",
             "rate at which the drive plays it, > 0 (Hz); required");
  describe(ExciteVisitor(*verb, *o), o->config);
  auto* periods = add_count(*verb, "--periods", o->periods, "periods, sweeps or passes to write, >= 1");
  CLI::Option* duration = nullptr;
  if (kind != Kind::chirp)
    duration = add_number(*verb, "--duration", o->record_s, "SECONDS", "length, instead of whole periods (s)")
                   ->excludes(periods);
  if (kind == Kind::multisine)
    add_count(*verb, "--realisations", o->realisations,
              "realisations to write, each with --periods-per-realisation periods, >= 1", 1)
        ->default_str("")
        ->excludes(periods)
        ->excludes(duration);
  verb->option_defaults()->group("Results");
  verb->add_option("--out", o->out, "CSV file with time_s, excitation ('-': standard output)")
      ->type_name("FILE");
  verb->add_option("--json", o->json, "what is known of it, for machines ('-': standard output)")
      ->type_name("FILE");
  verb->callback([verb, o] { run_excite(*verb, *o); });
}

}  // namespace

void add_excite(CLI::App& app) {
  auto* excite =
      app.add_subcommand("excite", "Makes an excitation and reports crest factor, rms, band and length");
  excite->footer(
      "Example:\n  resonid excite chirp --sample-rate 500 --from 35 --to 1.5 --duration 17 --out chirp.csv\n"
      "'resonid excite KIND --help' lists the options of a kind.");
  add_kind(*excite, Kind::prbs, "Pseudo-random binary sequence of maximum length",
           "prbs --sample-rate 500 --amplitude 2.1 --register-length 10 --out prbs.csv");
  add_kind(
      *excite, Kind::multisine, "Sum of sines at chosen lines",
      "multisine --sample-rate 2000 --lines 20:120:5 --amplitude 0.3 --phases optimised --out multisine.csv\n"
      "  resonid excite multisine --sample-rate 500 --lines 1:40:0.5 --phases random --leave-out odd-random\n"
      "      --periods-per-realisation 5 --realisations 8 --out realisations.csv");
  add_kind(*excite, Kind::chirp, "Sine that sweeps from one frequency to another",
           "chirp --sample-rate 500 --from 35 --to 1.5 --duration 17 --out chirp.csv");
  add_kind(*excite, Kind::stepped_sine, "One sine after another: settle, then measure",
           "stepped-sine --sample-rate 500 --lines 5:30:1 --settle-periods 5 --measure-periods 10 --out "
           "stepped.csv");
  excite->callback([excite] {
    if (excite->get_subcommands().empty())
      throw UsageError("excite: a kind is required: prbs, multisine, chirp or stepped-sine");
  });
}

}  // namespace resonid::cli
