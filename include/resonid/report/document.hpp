// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

namespace resonid::report {

/// One line of a table that sets published, reproduced and true values side by side.
struct Comparison {
  std::string quantity;              ///< "phase margin"
  std::string unit;                  ///< "deg"; empty for plain numbers
  std::optional<double> published;   ///< as printed in the source; none where it shows a picture only
  std::optional<double> reproduced;  ///< over several seeds: the mean
  std::optional<double> deviation;   ///< standard deviation over the seeds
  std::optional<double> truth;       ///< of the simulated machine
  std::string note;                  ///< where it falls outside, or needs a word
  double rounding = 0.0;             ///< smaller magnitudes of `reproduced` are shown as "< rounding"
};

struct ComparisonTable {
  std::string title;
  std::vector<Comparison> rows;
};

/// One curve, or one set of points, of a chart.
struct Curve {
  enum class Mark { line, dashed, points };
  std::string name;
  Mark mark = Mark::line;
  std::vector<double> x;  ///< [point]; ascending unless the chart has equal axes
  std::vector<double> y;  ///< [point]; a gap where not finite
  /// [point]; what a plane's points belong to, told where one is pointed at (their frequency); may be empty
  std::vector<double> at = {};
};

struct Chart {
  std::string title;  ///< with the number of the figure whose counterpart it is
  std::string x_label;
  std::string y_label;
  bool log_x = false;
  bool equal_axes = false;  ///< a plane (Nyquist plots): both axes alike, x in any order
  std::vector<Curve> curves;
  std::string caption;
  std::string at_unit = "Hz";  ///< of Curve::at
};

/// A place where the print contradicts itself or its own figures, and what was taken instead.
struct Discrepancy {
  std::string place;
  std::string printed;
  std::string taken;
  std::string reason;
};

struct Section {
  std::string title;
  std::vector<std::string> text;  ///< plain paragraphs
  std::vector<ComparisonTable> tables;
  std::vector<Chart> charts;
};

/// A page of text, tables and charts about measured figures.
struct Document {
  std::string title;
  std::string command;  ///< what makes it again
  std::vector<std::string> summary;
  std::vector<Section> sections;
  std::vector<Discrepancy> discrepancies;
  /// Noisy runs that means and deviations are taken over; every form of the document says so. 0: none.
  std::size_t seeds = 0;
};

/// One self-contained HTML page: no network, no other files, readable on a phone, in the dark and on paper.
/// Text and tables stand in it as they are; a script draws the charts from numbers of 7 digits. Text of any
/// origin is escaped, bytes that are not UTF-8 are replaced. "+-" in texts becomes the sign, in Markdown too.
[[nodiscard]] std::string document_page(const Document& document);

/// The same without the charts, as Markdown.
[[nodiscard]] std::string document_markdown(const Document& document);

/// The tables and discrepancies as text for a terminal.
[[nodiscard]] std::string document_text(const Document& document);

/// Everything, for machines, in full precision; absent values are left out, values that are not finite are
/// null:
///
///     {schema: "resonid.document/1", title, command, seeds, summary: [""],
///      sections: [{title, text: [""], tables: [table], charts: [chart]}],
///      discrepancies: [{place, printed, taken, reason}]}
///     table: {title, rows: [{quantity, unit, published, reproduced, deviation, true, note}]}
///     chart: {title, x_label, y_label, log_x, equal_axes, caption, curves: [{name, mark, x, y, at,
///     at_unit}]}
[[nodiscard]] nlohmann::json document_json(const Document& document);

}  // namespace resonid::report
