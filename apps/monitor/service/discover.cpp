// SPDX-License-Identifier: MIT
#include "monitor/service/discover.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <resonid/base/error_text.hpp>
#include <resonid/identification/detail/inspect.hpp>
#include <resonid/io/detail/column_facts.hpp>
#include <resonid/io/detail/number_list.hpp>
#include <resonid/io/record_reader.hpp>
#include <set>

#include "io/described_text.hpp"
#include "io/signal_units.hpp"
#include "io/text.hpp"
#include "io/units.hpp"
#include "monitor/service/axis_spec_of.hpp"

namespace resonid::monitor {
namespace {

/// One that is not taken, and is now.
std::string own_name(const std::string& name, std::set<std::string>& taken) {
  std::string own = name;
  for (int i = 2; !taken.insert(own).second; ++i) own = fmt::format("{}-{}", name, i);
  return own;
}

/// The rate that people set where one is near, else four digits of it.
double rounded_rate(double measured_hz) {
  constexpr double kNear = 0.005;
  constexpr std::array<double, 7> kUsual = {1.0, 1.25, 1.6, 2.0, 2.5, 4.0, 8.0};
  const double decade = std::pow(10.0, std::floor(std::log10(measured_hz)));
  double rounded = measured_hz;
  for (const double usual : kUsual)
    for (const double rate : {usual * decade, 5.0 * decade, 10.0 * decade})
      if (std::abs(measured_hz / rate - 1.0) < kNear) rounded = rate;
  // By its text: products of powers of ten are printed with digits that nobody measured.
  return io::parse_number(fmt::format("{:.4g}", rounded)).value_or(rounded);
}

/// Acceleration of the output, but for a factor, one sample shorter per difference.
std::vector<double> acceleration_of(const data::Record& record) {
  std::vector<double> a = record.output.samples;
  const int differences = record.output_quantity == data::OutputQuantity::velocity   ? 1
                          : record.output_quantity == data::OutputQuantity::position ? 2
                                                                                     : 0;
  for (int i = 0; i < differences; ++i) {
    for (std::size_t k = 0; k + 1 < a.size(); ++k) a[k] = a[k + 1] - a[k];
    a.pop_back();
  }
  return a;
}

void remove_mean(std::vector<double>& x) {
  double sum = 0.0;
  for (const double v : x) sum += v;
  for (double& v : x) v -= sum / static_cast<double>(x.size());
}

/// Correlation of x with y `lag` samples later.
double correlation(const std::vector<double>& x, const std::vector<double>& y, std::size_t lag) {
  double xy = 0.0, xx = 0.0, yy = 0.0;
  for (std::size_t k = 0; k < x.size() && k + lag < y.size(); ++k) {
    xy += x[k] * y[k + lag];
    xx += x[k] * x[k];
    yy += y[k + lag] * y[k + lag];
  }
  return xx > 0.0 && yy > 0.0 ? xy / std::sqrt(xx * yy) : 0.0;
}

/// Whether a torque accelerates the output: 1, backwards: -1, or nothing that shows: 0. Told by the first of
/// the clear correlations of torque and acceleration, before the machine swings back.
int sign_of_output(const data::Record& record) {
  constexpr std::size_t kMostLag = 64, kLeastSamples = 100;
  constexpr double kClear = 6.0, kNearlyGreatest = 0.5;
  std::vector<double> torque = exciting(record), acceleration = acceleration_of(record);
  if (acceleration.size() < kLeastSamples) return 0;
  remove_mean(torque);
  remove_mean(acceleration);
  std::vector<double> all;
  double greatest = 0.0;
  for (std::size_t lag = 0; lag < std::min(kMostLag, acceleration.size() / 4); ++lag) {
    all.push_back(correlation(torque, acceleration, lag));
    greatest = std::max(greatest, std::abs(all.back()));
  }
  if (greatest * std::sqrt(static_cast<double>(acceleration.size())) < kClear) return 0;
  const auto first = std::find_if(all.begin(), all.end(),
                                  [&](double c) { return std::abs(c) > kNearlyGreatest * greatest; });
  return *first > 0.0 ? 1 : -1;
}

class Proposer {
 public:
  Proposer(const StreamFacts& facts, Proposal& proposal) : facts_(facts), p_(proposal) {
    table_.source = facts.axis.empty() ? facts.source : facts.axis;
    table_.names = facts.columns;
    table_.columns = facts.samples;
    table_.columns.resize(table_.names.size());
  }

  void propose() {
    p_.axis.source = facts_.source;
    if (p_.name != facts_.axis) p_.axis.channel = facts_.axis;
    for (const auto& c : io::column_facts(table_))
      note(fmt::format("column {}{}{}{}", io::in_quotes(c.name), c.guess.empty() ? "" : ", " + c.guess,
                       c.unit.empty() ? "" : " in " + c.unit,
                       c.least <= c.greatest ? fmt::format(", {:.4g} ... {:.4g}", c.least, c.greatest) : ""));
    if (facts_.timed) note("samples come with their time, which is followed: it needs no key");
    rate();
    io::ColumnMapping mapping;
    mapping.time = "none";
    mapping.sample_rate_hz = p_.axis.sample_rate_hz > 0.0 ? p_.axis.sample_rate_hz : 1.0;
    const auto record = io::to_record(table_, mapping);
    if (record) return of_record(*record);
    note("input and output are left to you: " + library_keys(record.error().requirement.str()));
  }

 private:
  void note(const std::string& text) {
    std::string line;
    for (const char c : text) line += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? ' ' : c;
    p_.notes.push_back(std::move(line));
  }

  void rate() {
    constexpr double kLeastRate_hz = 1e-3, kMostRate_hz = 1e6;  // as of an axis
    double measured = facts_.sample_rate_hz;
    if (!(measured > 0.0)) measured = rate_of_times();
    const bool by_arrival = !(measured > 0.0) && facts_.arrival_rate_hz > 0.0;
    if (by_arrival) measured = facts_.arrival_rate_hz;
    if (!(measured >= kLeastRate_hz && measured <= kMostRate_hz))
      return note(
          "the sample rate is not known: sample_rate_hz is left to you; a 'time' or 'timestamp' tells it as "
          "UNIX "
          "time or ISO 8601, and is passed over, no column, where it counts from the start");
    p_.axis.sample_rate_hz = rounded_rate(measured);
    if (by_arrival)
      note(fmt::format("sample rate measured by arrival: {:.6g} Hz; check it", measured));
    else if (p_.axis.sample_rate_hz != measured)
      note(fmt::format("measured sample rate: {:.6g} Hz", measured));
  }

  /// By a column of times, whichever columns the signals are; 0: none.
  [[nodiscard]] double rate_of_times() const {
    if (const auto record = io::to_record(table_, {})) return record->sample_rate_hz;
    const auto& names = table_.names;
    io::ColumnMapping any;
    for (std::size_t k = 0; k < names.size(); ++k) {
      any.input = names[k];
      any.output = names[(k + 1) % names.size()];
      if (const auto record = io::to_record(table_, any)) return record->sample_rate_hz;
    }
    return 0.0;
  }

  void of_record(const data::Record& record) {
    auto& a = p_.axis;
    a.input = record.input.name;
    a.output = record.output.name;
    a.excitation = record.excitation.name;
    a.position = record.position.name;
    a.motion = record.motion;
    a.output_quantity = record.output_quantity;
    for (const auto& assumed : record.reading) note(library_keys(assumed));
    if (!record.excitation.present())
      note("no column is called like an excitation: only what the machine does by itself excites it");
    if (a.sample_rate_hz > 0.0)
      if (const auto seen = identification::inspect(record))
        note(fmt::format("excitation in {}: {}; loop: {}", io::in_quotes(seen->exciting), seen->excitation,
                         name_of(seen->loop)));
    check_unit_of_output();
    const int sign = sign_of_output(record);
    if (sign < 0) a.output_scale = -1.0;
    note(sign == 0  ? "the sign of the output does not show"
         : sign > 0 ? "a positive torque accelerates the output: signs agree"
                    : "a positive torque accelerates the output backwards: its sign is turned round");
  }

  /// What is in volts is a position or velocity only by a scale that nobody here knows.
  void check_unit_of_output() {
    const std::string unit = unit_in_name(p_.axis.output);
    const auto known = io::known_unit(unit);
    const auto quantity = known ? io::quantity_of(known->dimension) : std::nullopt;
    if (!known || quantity == p_.axis.output_quantity) return;
    note(fmt::format("{} is in {}, which is no {}: output, output_unit and output_scale are left to you",
                     io::in_quotes(p_.axis.output), unit, name_of(p_.axis.output_quantity)));
    p_.axis.output.clear();
  }

  const StreamFacts& facts_;
  Proposal& p_;
  io::Table table_;
};

/// Keys that are not as by default, and those that say what a source is.
std::vector<io::DescribedKey> differing_keys(const Configuration& configuration, const Configuration& usual) {
  auto keys = io::described_keys(configuration);
  const auto standard = io::described_keys(usual);
  std::erase_if(keys, [&](const io::DescribedKey& key) {
    return key.key != "kind" && key.key != "format" &&
           std::find(standard.begin(), standard.end(), key) != standard.end();
  });
  return keys;
}

std::string missing_keys(const AxisConfig& axis) {
  std::string text;
  if (!(axis.sample_rate_hz > 0.0)) text += "sample_rate_hz =\n";
  if (axis.input.empty()) text += "input = \"\"\n";
  if (axis.output.empty()) text += "output = \"\"\n";
  return text;
}

std::string in_comments(std::string_view lines) {
  std::string text;
  for (std::size_t end = 0; !lines.empty(); lines.remove_prefix(end + 1)) {
    end = lines.find('\n');
    text += fmt::format("#{}\n", lines.substr(0, end));
  }
  return text;
}

}  // namespace

std::vector<Proposal> propose(std::span<const StreamFacts> streams) {
  std::set<std::string> taken;
  std::vector<Proposal> proposals;
  for (const auto& facts : streams) {
    Proposal& proposal = proposals.emplace_back();
    proposal.name = own_name(axis_name(facts.axis.empty() ? facts.source : facts.axis), taken);
    Proposer(facts, proposal).propose();
  }
  return proposals;
}

std::string proposal_text(const std::map<std::string, SourceConfig>& sources,
                          std::span<const Proposal> proposals) {
  Configuration service, standard;
  service.monitor.data = "data";
  for (const auto& [name, source] : sources) {
    service.sources.tables[name] = source;
    standard.sources.tables[name].kind = source.kind;
  }
  std::string text = io::toml_of(differing_keys(service, standard)) + '\n';
  for (const auto& proposal : proposals) {
    Configuration one, usual;
    one.axes.tables[proposal.name] = proposal.axis;
    usual.axes.tables[proposal.name] = AxisConfig{};
    for (const auto& line : proposal.notes) text += fmt::format("# {}\n", line);
    const std::string table = io::toml_of(differing_keys(one, usual));
    text += (proposal.complete() ? table : in_comments(table + missing_keys(proposal.axis))) + '\n';
  }
  text.pop_back();
  return text;
}

}  // namespace resonid::monitor
