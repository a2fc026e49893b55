// SPDX-License-Identifier: MIT
#include "report/result_lists.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <resonid/identification/detail/figures.hpp>

#include "report/words.hpp"

namespace resonid::report {
namespace {

using identification::Result;
using nlohmann::json;

json matrix_json(const Eigen::MatrixXd& m) {
  json rows = json::array();
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    json row = json::array();
    for (Eigen::Index k = 0; k < m.cols(); ++k) row.push_back(m(i, k));
    rows.push_back(std::move(row));
  }
  return rows;
}

/// A square matrix of the given size; zero, and noted as wrong, where it is not.
Eigen::MatrixXd read_matrix(const JsonPlace& j, Eigen::Index size) {
  Eigen::MatrixXd m = Eigen::MatrixXd::Zero(size, size);
  const auto rows = j.elements();
  const auto wanted = static_cast<std::size_t>(size);
  if (rows.size() != wanted) j.refuse(fmt::format("{} rows", size));
  for (std::size_t i = 0; i < std::min(rows.size(), wanted); ++i) {
    const auto row = rows[i].numbers();
    if (row.size() != wanted) rows[i].refuse(fmt::format("{} numbers", size));
    for (std::size_t k = 0; k < std::min(row.size(), wanted); ++k)
      m(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) = row[k];
  }
  return m;
}

json structures_json(const std::vector<identification::StructureTrial>& trials) {
  json list = json::array();
  for (const auto& t : trials) {
    json j{{"name", t.name}, {"parameters", t.parameters}, {"chosen", t.chosen}};
    if (std::isfinite(t.bic)) j["information"] = t.bic;
    if (t.holdout_fit_percent && std::isfinite(*t.holdout_fit_percent))
      j["validation_fit_percent"] = *t.holdout_fit_percent;
    if (t.holdout_score && std::isfinite(*t.holdout_score)) j["validation_information"] = *t.holdout_score;
    if (t.independent_fit_percent && std::isfinite(*t.independent_fit_percent))
      j["independent_fit_percent"] = *t.independent_fit_percent;
    if (!t.remark.empty()) j["remark"] = t.remark;
    list.push_back(std::move(j));
  }
  return list;
}

std::vector<identification::StructureTrial> read_structures(const JsonPlace& j) {
  std::vector<identification::StructureTrial> list;
  for (const auto& e : j.elements()) {
    identification::StructureTrial t;
    t.name = e.at("name").text();
    t.parameters = e.at("parameters").count();
    t.bic = e.maybe_number("information").value_or(std::nan(""));
    t.holdout_fit_percent = e.maybe_number("validation_fit_percent");
    t.holdout_score = e.maybe_number("validation_information");
    t.independent_fit_percent = e.maybe_number("independent_fit_percent");
    t.chosen = e.at("chosen").flag();
    t.remark = e.maybe_text("remark");
    list.push_back(std::move(t));
  }
  return list;
}

void put_roots(const Result& result, json& to) {
  for (const auto& root : result.roots) {
    json j{{"real", root.value.real()}, {"imag", root.value.imag()}};
    if (root.covariance.allFinite()) j["covariance"] = matrix_json(root.covariance);
    to[root.kind == "zero" ? "zeros" : "poles"].push_back(std::move(j));
  }
}

void read_roots(const JsonPlace& j, const char* kind, std::vector<identification::Root>& roots) {
  if (!j.present()) return;
  for (const auto& e : j.elements()) {
    identification::Root root;
    root.value = {e.at("real").number(), e.at("imag").number()};
    if (const auto covariance = e.maybe("covariance"); covariance.present())
      root.covariance = read_matrix(covariance, 2);
    root.kind = kind;
    roots.push_back(std::move(root));
  }
}

json bootstrap_json(const identification::Bootstrap& bootstrap) {
  json intervals = json::array();
  for (const auto& i : bootstrap.intervals)
    intervals.push_back({{"name", i.name},
                         {"unit", i.unit},
                         {"low", i.low},
                         {"high", i.high},
                         {"std", i.std},
                         {"values", i.values}});
  return {
      {"replicas", bootstrap.replicas}, {"failed", bootstrap.failed}, {"intervals", std::move(intervals)}};
}

identification::Bootstrap read_bootstrap(const JsonPlace& j) {
  identification::Bootstrap bootstrap;
  bootstrap.replicas = j.at("replicas").count();
  bootstrap.failed = j.at("failed").count();
  for (const auto& e : j.at("intervals").elements()) {
    bootstrap.intervals.push_back({e.at("name").text(),
                                   e.at("unit").text(),
                                   e.at("low").number(),
                                   e.at("high").number(),
                                   e.at("std").not_negative(),
                                   {}});
    const auto values = e.maybe("values");
    if (!values.present()) continue;
    bootstrap.intervals.back().values = values.numbers();
    if (bootstrap.intervals.back().values.size() != bootstrap.intervals.front().values.size())
      values.refuse("as many numbers as the other figures have");
  }
  return bootstrap;
}

/// "b0 ... bn, a1 ... am", as the covariance of a black-box model orders them.
std::vector<std::string> coefficient_names(const data::TransferFunction& g) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < g.numerator.size(); ++i) names.push_back(fmt::format("b{}", i));
  for (std::size_t i = 1; i < g.denominator.size(); ++i) names.push_back(fmt::format("a{}", i));
  return names;
}

}  // namespace

void put_lists(const Result& result, json& to) {
  for (const auto& c : result.choices)
    to["choices"].push_back({{"what", c.what}, {"chosen", c.chosen}, {"because", c.because}});
  if (!result.structures.empty()) to["structures"] = structures_json(result.structures);
  put_roots(result, to);
  if (result.bootstrap) to["bootstrap"] = bootstrap_json(*result.bootstrap);
}

void read_lists(const JsonPlace& from, Result& result) {
  if (const auto choices = from.maybe("choices"); choices.present())
    for (const auto& c : choices.elements())
      result.choices.push_back({c.at("what").text(), c.at("chosen").text(), c.at("because").text()});
  if (const auto s = from.maybe("structures"); s.present()) result.structures = read_structures(s);
  read_roots(from.maybe("poles"), "pole", result.roots);
  read_roots(from.maybe("zeros"), "zero", result.roots);
  if (const auto b = from.maybe("bootstrap"); b.present()) result.bootstrap = read_bootstrap(b);
}

json black_box_json(const identification::BlackBoxResult& black_box) {
  const auto& g = black_box.model.transfer_function;
  json j{{"structure", "black-box"},
         {"order", g.denominator.size() - 1},
         {"delay_samples", black_box.model.delay_samples},
         {"fit_percent", black_box.fit_percent},
         {"transfer_function",
          {{"numerator", g.numerator}, {"denominator", g.denominator}, {"sample_time_s", g.sample_time_s}}}};
  const auto& covariance = black_box.model.covariance;
  const auto names = coefficient_names(g);
  if (black_box.further_delay)
    j["delay"] = {
        {"value", black_box.further_delay->value}, {"std", black_box.further_delay->std}, {"unit", "s"}};
  if (covariance.allFinite() && covariance.rows() == static_cast<Eigen::Index>(names.size()))
    j["covariance"] = {{"parameters", names}, {"matrix", matrix_json(covariance)}};
  return j;
}

identification::BlackBoxResult read_black_box(const JsonPlace& model) {
  identification::BlackBoxResult black_box;
  auto& g = black_box.model.transfer_function;
  const auto place = model.at("transfer_function");
  g.numerator = place.at("numerator").numbers();
  g.denominator = place.at("denominator").numbers();
  g.sample_time_s = place.at("sample_time_s").positive();
  if (g.numerator.empty()) place.at("numerator").refuse("at least one number");
  if (g.denominator.empty() || g.denominator.front() != 1.0)
    place.at("denominator").refuse("numbers that begin with 1");
  if (g.denominator.empty()) g.denominator = {1.0};
  black_box.model.delay_samples = model.at("delay_samples").count();
  black_box.fit_percent = model.at("fit_percent").number();
  if (const auto d = model.maybe("delay"); d.present())
    black_box.further_delay = data::Estimate{d.at("value").number(), d.at("std").not_negative()};
  const auto names = coefficient_names(g);
  const auto size = static_cast<Eigen::Index>(names.size());
  black_box.model.covariance = Eigen::MatrixXd::Zero(size, size);
  if (const auto c = model.maybe("covariance"); c.present())
    black_box.model.covariance = read_matrix(c.at("matrix"), size);
  return black_box;
}

std::string choices_text(const Result& result) {
  if (result.choices.empty()) return "";
  std::string text = "\nChosen by the record\n";
  for (const auto& c : result.choices)
    text += wrapped(fmt::format("{}: {}. {}", c.what, c.chosen, c.because), "  ", "    ") + "\n";
  return text;
}

std::string structures_text(const Result& result) {
  if (result.structures.size() < 2) return "";
  std::size_t wide = 9;
  for (const auto& t : result.structures) wide = std::max(wide, t.name.size());
  double best = HUGE_VAL;
  for (const auto& t : result.structures)
    if (t.bic < best) best = t.bic;
  std::string text = fmt::format(
      "\nStructures side by side\n    {:<{}}  parameters  BIC above best  fit on the part held back\n",
      "structure", wide);
  for (const auto& t : result.structures) {
    text += fmt::format("  {} {:<{}}  {:>10}", t.chosen ? '*' : ' ', t.name, wide, t.parameters);
    const double above = t.bic - best;
    text += std::isfinite(above) ? fmt::format("  {:>14.1f}", above) : fmt::format("  {:>14}", "-");
    text += t.holdout_fit_percent ? fmt::format("  {:>22.2f} %", *t.holdout_fit_percent)
                                  : fmt::format("  {:>24}", "-");
    if (t.independent_fit_percent)
      text += fmt::format("\n      {:.2f} % of the other record", *t.independent_fit_percent);
    text += "\n";
    if (!t.remark.empty()) text += wrapped(t.remark, "      ", "      ") + "\n";
  }
  return text;
}

std::string bootstrap_text(const Result& result) {
  if (!result.bootstrap) return "";
  const auto& b = *result.bootstrap;
  std::string text = fmt::format("\nBootstrap, {} replicas{}; {:.0f} % intervals\n  {:<28}  {:<24}  {}\n",
                                 b.replicas, b.failed > 0 ? fmt::format(" ({} more failed)", b.failed) : "",
                                 100.0 * result.confidence, "", "of the replicas", "by the covariance");
  const double z = quantile(result.confidence);
  const auto told = identification::figures(result);
  for (const auto& i : b.intervals) {
    std::string name = i.name;
    std::replace(name.begin(), name.end(), '_', ' ');
    text += fmt::format("  {:<28}  {:<24}", name, interval_text(i.low, i.high));
    const auto* figure = identification::find(told, i.name);
    if (figure != nullptr && figure->std)
      text += "  " + interval_text(figure->value - z * *figure->std, figure->value + z * *figure->std);
    text += "\n";
  }
  return text;
}

}  // namespace resonid::report
