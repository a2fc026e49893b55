// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <resonid/base/enum_names.hpp>
#include <resonid/diagnostics/finding.hpp>
#include <resonid/report/detail/provenance.hpp>
#include <resonid/report/detail/typography.hpp>
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

/// A plain table: names of its columns, and cells as they are shown. Cells that are numbers stand to the
/// right.
struct Table {
  std::string title;
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;  ///< [row][column]
};

/// One quantity over several recordings: a row each, with its interval as a bar.
struct Intervals {
  struct Row {
    std::string name;  ///< What was measured: a file's name.
    double value = 0.0;
    double half_width = 0.0;  ///< Half the width of its interval; 0: unknown.
    bool marked = false;      ///< Doubtful: drawn paler.
  };
  std::string title;
  std::string unit;
  std::vector<Row> rows;
  std::optional<double> mean = {};  ///< Drawn through all rows.
  double mean_half_width = 0.0;     ///< Half the width of its interval; 0: unknown.
  std::string verdict = {};         ///< Beside the title: "agrees".
};

/// One curve, or one set of points, of a chart; with lower and upper also the band around it.
struct Curve {
  /// `band`: nothing but what lies between lower and upper; it has no y. `faint`: points that say little (no
  /// excitation); drawn pale, and the axes do not reach for them.
  enum class Mark { line, dashed, points, band, faint };
  std::string name;
  Mark mark = Mark::line;
  std::vector<double> x;  ///< [point]; ascending unless the chart has equal axes
  std::vector<double> y;  ///< [point]; a gap where not finite
  /// [point]; what a plane's points belong to, told where one is pointed at (their frequency); may be empty
  std::vector<double> at = {};
  /// [point]; bounds of a band, drawn in the curve's colour (not in a plane); a gap where either is not
  /// finite; may be empty
  std::vector<double> lower = {}, upper = {};
};
inline constexpr EnumName<Curve::Mark> kMarkNames[] = {{Curve::Mark::line, "line"},
                                                       {Curve::Mark::dashed, "dashed"},
                                                       {Curve::Mark::points, "points"},
                                                       {Curve::Mark::band, "band"},
                                                       {Curve::Mark::faint, "faint"}};
[[nodiscard]] constexpr std::span<const EnumName<Curve::Mark>> enum_names(Curve::Mark) noexcept {
  return kMarkNames;
}

/// A region behind the curves, or a place that they are compared with.
struct Shape {
  enum class Kind {
    circle,     ///< around (x, y), in a plane
    rectangle,  ///< from (x, y) to (x_end, y_end); an infinite side lies at the picture's edge
    cross,      ///< at (x, y), in a plane
  };
  Kind kind = Kind::rectangle;
  std::string name;  ///< in the legend; shapes of one name have one entry and one colour
  double x = 0.0, y = 0.0;
  double radius = 0.0;
  double x_end = 0.0, y_end = 0.0;
};
inline constexpr EnumName<Shape::Kind> kShapeNames[] = {
    {Shape::Kind::circle, "circle"}, {Shape::Kind::rectangle, "rectangle"}, {Shape::Kind::cross, "cross"}};
[[nodiscard]] constexpr std::span<const EnumName<Shape::Kind>> enum_names(Shape::Kind) noexcept {
  return kShapeNames;
}

/// Values over two axes as colours: a response's magnitude over time and frequency.
struct HeatMap {
  std::vector<double> x;  ///< Ascending.
  std::vector<double> y;  ///< Ascending.
  /// [y][x]; a gap where not finite.
  std::vector<std::vector<double>> value;
  std::string unit;  ///< "dB"
};

/// What an axis shows before it is zoomed.
struct AxisRange {
  double low = 0.0, high = 0.0;
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
  std::vector<Shape> shapes = {};
  /// Ranges of the axes; absent: that of all curves. In a plane both or neither count.
  std::optional<AxisRange> x_range = {}, y_range = {};
  /// In place of curves.
  std::optional<HeatMap> map = {};
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
  std::vector<Table> plain_tables = {};
  bool folded = false;  ///< shown by its title until it is opened; without charts
  std::vector<Intervals> intervals = {};
  bool side_by_side = false;  ///< Its charts and intervals in two columns where there is room.
  bool sheet = false;         ///< Part of the one printed page.
};

/// What the page says first, as a badge beside its title.
struct Badge {
  bool good = false;
  std::string word;      ///< "Trusted"
  std::string reason;    ///< In a few words; may be empty.
  bool warning = false;  ///< Where not good: something to look at rather than a failure.
};

/// A figure that a reader looks for first.
struct Card {
  std::string name;                     ///< "Resonance"
  std::string value;                    ///< "15.09"
  std::string unit = {};                ///< "Hz"
  std::vector<std::string> under = {};  ///< Lines below it: "+- 0.02 at 95 %".
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
  std::string kind = "reproduction";    ///< what the page calls itself, above its title
  std::optional<Badge> badge = {};      ///< the verdict, where there is one
  std::vector<Card> cards = {};         ///< at most six
  std::vector<std::string> facts = {};  ///< Below the title in one line: "8500 samples", "500 Hz".
  /// What to know of recording and result, beside the summary; absent: nothing was judged.
  std::optional<std::vector<diagnostics::Finding>> findings = {};
  std::optional<Provenance> provenance = {};  ///< At the page's end.
};

/// One self-contained HTML page: no network, no other files, readable on a phone, in the dark and on paper.
/// Text and tables stand in it as they are; a script draws the charts from numbers of 7 digits. Text of any
/// origin is escaped, bytes that are not UTF-8 are replaced. "+-" in texts becomes the sign, in Markdown too.
[[nodiscard]] std::string document_page(const Document& document);

/// The same without the charts, as Markdown.
[[nodiscard]] std::string document_markdown(const Document& document);

/// The tables and discrepancies as text for a terminal.
[[nodiscard]] std::string document_text(const Document& document, Characters characters = Characters::ascii);

/// Everything, for machines, in full precision; absent values are left out, values that are not finite are
/// null:
///
///     {schema: "resonid.document/1", title, command, seeds, badge: {good, word, reason},
///      cards: [{name, value, unit, under: [""]}], summary: [""],
///      sections: [{title, text: [""], tables: [table], charts: [chart], plain_tables: [{title, columns,
///      rows}]}],
///      discrepancies: [{place, printed, taken, reason}]}
///     table: {title, rows: [{quantity, unit, published, reproduced, deviation, true, note}]}
///     chart: {title, x_label, y_label, log_x, equal_axes, caption, curves: [{name, mark, x, y, at,
///     at_unit, lower, upper}], shapes: [{kind, name, x, y, radius, x_end, y_end}], x_range, y_range}
///
/// `badge`, `cards`, `plain_tables`, `shapes`, `lower`, `upper` and the ranges stand there only where there
/// are any; so do `warning` in a badge, `map` {x, y, value, unit} in a chart and `intervals` [{title, unit,
/// rows: [{name, value, half_width}], mean, mean_half_width, verdict}] in a section, and `facts` and
/// `findings` [{id, severity, meaning}].
[[nodiscard]] nlohmann::json document_json(const Document& document);

}  // namespace resonid::report
