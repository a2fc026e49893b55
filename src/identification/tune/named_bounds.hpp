// SPDX-License-Identifier: MIT
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <initializer_list>
#include <optional>
#include <resonid/identification/tune.hpp>
#include <string>

#include "design/closed_loop.hpp"

// Bounds as texts name them, and how a looser one is looked for.
namespace resonid::identification {

struct NamedBound {
  const char* field;
  const char* symbol;
  std::optional<double> design::Bounds::*bound;
  void (*ask)(TuneOptions&, double);
  double rest;     ///< What it is at standstill: what counts is by how much it is above that.
  double loosest;  ///< That is sensible; of |C S| the best PI tells it.
  int digits;      ///< With which what is above the rest is told.
};
inline constexpr NamedBound kNamedBounds[] = {
    {"largest_sensitivity", "|S|", &design::Bounds::sensitivity,
     [](TuneOptions& o, double value) { o.largest_sensitivity = value; }, 1.0, 2.5, 2},
    {"largest_load_transfer", "|T_load|", &design::Bounds::load_transfer,
     [](TuneOptions& o, double value) { o.largest_load_transfer = value; }, 1.0, 3.0, 2},
    {"largest_complementary", "|T|", &design::Bounds::complementary,
     [](TuneOptions& o, double value) { o.largest_complementary = value; }, 1.0, 3.0, 2},
    {"largest_controller_sensitivity", "|C S|", &design::Bounds::controller_sensitivity,
     [](TuneOptions& o, double value) { o.largest_controller_sensitivity = value; }, 0.0, 0.0, 3}};

/// As it is told: never less, so that what is asked for by the text is met too, and so many digits that it
/// differs from a bound that is tighter.
inline double rounded_up(const NamedBound& named, double value) {
  const double above = value - named.rest;
  if (!(above > 0.0)) return value;
  constexpr double kRounding = 1e-9;
  const double scale = std::pow(10.0, named.digits - 1 - std::floor(std::log10(above)));
  return named.rest + std::ceil(above * scale * (1.0 - kRounding)) / scale;
}

/// "|S| <= 1.0046"
inline std::string bound_text(const NamedBound& named, double value) {
  return fmt::format("{} <= {:.10g}", named.symbol, value);
}

/// A list of them: "a or b".
inline void add_to_list(std::string& list, const std::string& item, const char* between) {
  list += (list.empty() ? "" : between) + item;
}

/// The least value of a bound that is enough, from one that is not up to one that is, to within a part of
/// what it is above its rest.
template <class Enough>
double least_enough(const NamedBound& named, double low, double high, double part, const Enough& is_enough) {
  double not_enough = low - named.rest, enough = high - named.rest;
  while (enough > (1.0 + part) * not_enough) {
    const double middle = std::sqrt(not_enough * enough);
    (is_enough(named.rest + middle) ? enough : not_enough) = middle;
  }
  return named.rest + enough;
}

/// The first value, as it is told, from a least one on that is enough; nothing where none near to it is.
template <class Enough>
std::optional<double> told_enough(const NamedBound& named, double least, std::initializer_list<double> times,
                                  const Enough& is_enough) {
  for (const double factor : times) {
    const double value = rounded_up(named, named.rest + factor * (least - named.rest));
    if (is_enough(value)) return value;
  }
  return std::nullopt;
}

}  // namespace resonid::identification
