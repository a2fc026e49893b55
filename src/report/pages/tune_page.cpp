// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <resonid/report/detail/tune.hpp>

#include "report/document/tune_words.hpp"
#include "report/pages/curves.hpp"
#include "report/pages/tune_charts.hpp"

namespace resonid::report {
namespace {

using identification::LoopFigure;
using identification::TunedController;
using identification::Tuning;

const LoopFigure* figure_of(const TunedController& c, std::string_view name) {
  const auto found = std::find_if(c.figures.begin(), c.figures.end(),
                                  [&](const LoopFigure& figure) { return figure.name == name; });
  return found == c.figures.end() || !std::isfinite(found->value) ? nullptr : &*found;
}

/// A figure with its bound, and with its interval unless something else matters more.
void put_figure_card(std::vector<Card>& cards, const TunedController& c, const char* name,
                     const std::string& title, const std::string& instead = {}) {
  const auto* figure = figure_of(c, name);
  if (figure == nullptr || !c.stable) return;
  const auto unit = shown_unit(*figure);
  Card card{title, unit.number(figure->value), unit.unit, {}};
  if (!instead.empty())
    card.under.push_back(instead);
  else if (figure->low && figure->high)
    card.under.push_back(
        fmt::format("95 %: {} ... {}", unit.number(*figure->low), unit.number(*figure->high)));
  if (is_worst_alone(*figure)) card.under.push_back("worst case");
  if (figure->bound) card.under.push_back("bound " + unit.number(*figure->bound));
  cards.push_back(std::move(card));
}

/// The place of the proposed controller, where gains go over position: "at position 0.385"; else empty.
std::string place_words(const Tuning& t) {
  return t.schedule && !t.schedule->nodes.empty()
             ? fmt::format("at position {:.4g}", t.schedule->nodes.front().position)
             : std::string();
}

Card exceeding_card(const Tuning& t) {
  const auto& c = t.proposed();
  Card card{"Beyond a bound",
            c.exceeding == 0 ? "none" : share_text(c.probability()),
            "",
            {fmt::format("of {} machines", grouped(c.draws)),
             c.unstable == 0 ? "none unstable" : grouped(c.unstable) + " unstable"}};
  if (!t.schedule || t.schedule->places.empty()) return card;
  card.value = share_text(t.schedule->probability());
  card.under.back() = fmt::format("at position {:.4g}, where most", t.schedule->worst_position);
  return card;
}

std::vector<Card> tune_cards(const Tuning& t) {
  const auto& c = t.proposed();
  const std::string gains_name = is_p(c) ? "Gain kp" : "Gains kp, ki";
  std::vector<Card> cards;
  const auto units = gain_units(t.units.input, t.units.velocity);
  if (c.gains) {
    const auto both = [&](const std::string& kp, const std::string& ki) {
      return is_p(c) ? kp : kp + ", " + ki;
    };
    Card card{gains_name, both(three_digits(c.gains->kp), three_digits(c.gains->ki)), "", {}};
    card.under = {both(units.kp, units.ki)};
    if (const auto own = own_gains(t))
      card.under.push_back("recorded: " +
                           both(three_digits(own->factor * c.gains->kp) + " " + own->units.kp,
                                three_digits(own->factor * c.gains->ki) + " " + own->units.ki));
    if (c.gains->ki > 0.0) card.under.push_back("Ti " + time_text(c.gains->kp / c.gains->ki));
    if (c.position_gain) card.under.push_back(fmt::format("kv {} 1/s", three_digits(*c.position_gain)));
    cards.push_back(std::move(card));
  }
  put_figure_card(cards, c, "sensitivity_peak", "Largest |S| (Ms)");
  put_figure_card(cards, c, "load_peak", c.position_gain ? "Largest |T_position|" : "Largest |T_load|");
  put_figure_card(cards, c, "phase_margin_deg", "Phase margin");
  std::string against;
  if (const auto ratio = stiffer_by(t)) against = stiffness_words(*ratio);
  put_figure_card(cards, c, "load_step_iae", "Load step, IAE", against);
  if (const auto place = place_words(t); !place.empty())
    for (Card& card : cards) card.under.push_back(place);
  if (is_for_several(t))
    for (Card& card : cards)
      if (card.name != gains_name) card.under.push_back("machine of " + base_name(first_file(t)));
  if (c.draws > 0) cards.push_back(exceeding_card(t));
  return cards;
}

Badge tune_badge(const Tuning& t) {
  const auto& c = t.proposed();
  const auto bounds = bounds_text(c);
  Badge b;
  b.reason = bounds.empty() ? c.name : bounds;
  if (!c.stable && t.by_response) {
    b.word = stability_is_unknown(t) ? "Not told stable" : "Unstable";
    b.reason = "by " + machine_words(t);
  } else if (!c.stable) {
    b.word = "Unstable";
    b.reason = is_for_several(t) ? "on an identified machine" : "on the identified machine";
  } else if (t.options.force && !t.trusted) {
    b.word = "Forced, not trusted";
    b.reason = "see the findings";
  } else if (!results_are_trusted(t)) {
    b.word = "Not trusted";
    b.reason = "see the findings";
  } else if (!c.within) {
    b.word = "Bounds not kept";
    b.warning = t.is_evaluation();
  } else {
    b.good = true;
    b.word = fmt::format("Bounds kept, {:g} %", 100.0 * t.options.confidence);
    if (t.schedule) b.reason = "at every position: " + b.reason;
  }
  return b;
}

/// Value, bound and worst case beside each other, which a phone shows without moving the table.
Table bounds_first(Table table) {
  std::size_t to = 2;
  for (const auto* name : {"bound", "worst"}) {
    const auto found = std::find(table.columns.begin(), table.columns.end(), name);
    if (found == table.columns.end()) continue;
    const auto move_to = [&](std::vector<std::string>& list, std::ptrdiff_t from) {
      std::rotate(list.begin() + static_cast<std::ptrdiff_t>(to), list.begin() + from,
                  list.begin() + from + 1);
    };
    const auto from = found - table.columns.begin();
    move_to(table.columns, from);
    for (auto& row : table.rows) move_to(row, from);
    ++to;
  }
  return table;
}

Section figures_section_of(const Tuning& t) {
  Section s;
  s.title = "What the loop does";
  s.plain_tables = {bounds_first(figure_table(t.proposed()))};
  if (!t.proposed().crossings.empty()) s.plain_tables.push_back(crossing_table(t.proposed()));
  s.text = {
      t.by_response ? "Values are those of the measured response at its lines and on the way from one to "
                      "the next; the worst case is that of every response within the error bars of all lines "
                      "at once. What a response alone does not tell has a "
                      "worst case "
                      "only."
      : is_for_several(t)
          ? fmt::format("Values are those of {}; the interval is that of 95 % of the machines that its "
                        "identification leaves possible, the worst case that of the ellipsoids of all {} "
                        "machines which were designed for, and the last column the share that exceeds the "
                        "bound where most do.",
                        machine_words(t), t.machines.size())
          : "Values are those of the identified machine; the interval is that of 95 % of the machines that "
            "the identification leaves possible, the worst case that of the ellipsoid which was designed "
            "for, and the last column the share of machines that exceed the bound."};
  for (auto& text : loop_sentences(t)) s.text.push_back(std::move(text));
  return s;
}

Table filter_table(const TunedController& c) {
  Table table{"Biquads, b0 b1 b2 over 1 a1 a2 in powers of z^-1",
              {"biquad", "in Hz", "damping", "b0", "b1", "b2", "a1", "a2"},
              {}};
  if (!c.gains || !(c.feedback.sample_time_s > 0.0)) return table;
  for (std::size_t i = 0; i < c.gains->biquads.size(); ++i) {
    const auto& b = c.gains->biquads[i];
    const auto k = b.coefficients(c.feedback.sample_time_s);
    table.rows.push_back({std::to_string(i + 1), three_digits(b.frequency_hz),
                          fmt::format("{:.3g} over {:.3g}", b.numerator_damping, b.denominator_damping)});
    for (const double v : {k.b[0], k.b[1], k.b[2], k.a[1], k.a[2]})
      table.rows.back().push_back(fmt::format("{:.9g}", v));
  }
  return table;
}

std::string variance_cell(double factor) {
  return factor == 1.0 ? "as it is" : factor == 0.0 ? "none" : fmt::format("times {:.3g}", factor);
}

Section controllers_section(const Tuning& t) {
  Section s;
  s.title = t.candidates.size() > 1 ? "Controllers that were compared" : "Controllers";
  s.plain_tables = {candidate_table(t)};
  if (auto text = nominal_sentence(t); !text.empty()) s.text = {std::move(text)};
  if (auto filters = filter_table(t.proposed()); !filters.rows.empty())
    s.plain_tables.push_back(std::move(filters));
  if (t.experiment.size() > 1) {
    Table table{
        "What a better experiment would buy", {"variance", "of the delay", "ki", "IAE of the load step"}, {}};
    for (const auto& v : t.experiment)
      table.rows.push_back({variance_cell(v.factor), variance_cell(v.delay_factor),
                            v.ki > 0.0 ? three_digits(v.ki) : "", three_digits(v.iae)});
    s.plain_tables.push_back(std::move(table));
  }
  return s;
}

std::string tune_title(const Tuning& t) {
  std::string text = t.is_evaluation() ? "Evaluation of " + t.proposed().name : t.proposed().name;
  if (!t.files.empty()) text += " for " + base_name(t.files.front());
  return t.files.size() > 1 ? text + fmt::format(" and {} more", t.files.size() - 1) : text;
}

}  // namespace

Document document(const Tuning& t) {
  Document d;
  d.kind = t.is_evaluation() ? "evaluation of a controller" : "controller";
  d.title = tune_title(t);
  if (t.sample_time_s > 0.0) d.facts.push_back(fmt::format("{:g} Hz", 1.0 / t.sample_time_s));
  if (!t.machines.empty()) {
    const auto& m = t.machines.front();
    d.facts.push_back(t.machines.size() == 1
                          ? fmt::format("{} drive", fit::name_of(m.structure))
                          : fmt::format("{} machines, {}", t.machines.size(), fit::name_of(m.structure)));
    d.facts.push_back(fmt::format("delay {} ms", three_digits(1e3 * (m.known_delay_s + m.delay_s))));
  }
  d.summary = lead_sentences(t);
  const auto place = place_words(t);
  if (auto text = schedule_sentence(t); !text.empty()) d.summary.push_back(std::move(text));
  if (!place.empty())
    d.summary.push_back("Gains, figures and curves below are those " + place +
                        " unless they say otherwise; section 'Gains over position' has all of them.");
  d.badge = tune_badge(t);
  d.cards = tune_cards(t);
  d.findings = t.findings;
  const auto put = [&](Section s) {
    if (!s.charts.empty() || !s.plain_tables.empty()) d.sections.push_back(std::move(s));
  };
  put(check_section(t));
  const auto put_there = [&](Section s) {
    if (!place.empty()) s.title += ", " + place;
    put(std::move(s));
  };
  put_there(step_section(t));
  put_there(sensitivity_section(t));
  put_there(torque_section(t));
  put_there(loop_section(t));
  if (t.proposed().stable && !t.proposed().figures.empty()) put_there(figures_section_of(t));
  put(controllers_section(t));
  Section cost;
  cost.title = "What the bounds cost";
  cost.text = {
      t.machines.size() > 1
          ? "The best PI for all machines under each bound, the others as they are; the error is their mean."
          : "The best PI of the identified machine under each bound, the others as they are."};
  cost.charts = trade_off_charts(t);
  cost.side_by_side = true;
  put(std::move(cost));
  put(schedule_section(t));
  Section shapers;
  shapers.title = "Input shapers";
  if (!t.shapers.empty()) shapers.plain_tables = {shaper_table(t)};
  if (!t.shapers.empty()) shapers.plain_tables.front().title = "";
  if (!t.shapers.empty()) shapers.text = {shaper_sentence(t)};
  put(std::move(shapers));
  put(simulated_section(t));
  return d;
}

}  // namespace resonid::report
