// SPDX-License-Identifier: MIT
#include "io/csv_header.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>

#include "io/csv_format.hpp"
#include "io/text.hpp"
#include "io/text_encoding.hpp"
#include "io/units.hpp"

namespace resonid::io {
namespace {

std::vector<std::string> texts_of(const std::vector<Field>& fields) {
  std::vector<std::string> texts;
  for (const Field& field : fields) texts.push_back(field.text);
  return texts;
}

/// As many fields as columns, or one more that is empty, or one less where rows end with an empty one.
bool fits(const std::vector<Field>& fields, std::size_t width, bool ends_empty) {
  return fields.size() == width || (fields.size() == width + 1 && fields.back().text.empty()) ||
         (ends_empty && fields.size() + 1 == width);
}

/// At least half of the fields are units that are known or in brackets, the others empty or a dash.
bool holds_units(const std::vector<Field>& fields) {
  std::size_t units = 0;
  for (const Field& field : fields) {
    const std::string text = as_utf8(field.text);
    const bool bracketed = text.size() > 1 && ((text.front() == '[' && text.back() == ']') ||
                                               (text.front() == '(' && text.back() == ')'));
    const bool known = known_unit(text).has_value() || bracketed;
    if (!known && !text.empty() && text != "-" && text != "1") return false;
    units += known ? 1U : 0U;
  }
  return 2 * units >= fields.size() && units > 0;
}

std::string without_brackets(std::string text) {
  if (text == "-" || text == "1") return {};
  if (text.size() > 1 && (text.front() == '[' || text.front() == '(')) return text.substr(1, text.size() - 2);
  return text;
}

class HeaderFinder {
 public:
  HeaderFinder(const std::string& file, std::span<const TextLine> above, const RowWidth& width,
               char separator)
      : file_(file),
        above_(above),
        width_(width.fields),
        ends_empty_(width.ends_empty),
        separator_(separator) {}

  expected<Header, Error> named(std::size_t line) {
    const auto found =
        std::find_if(above_.begin(), above_.end(), [&](const TextLine& l) { return l.number == line; });
    if (found == above_.end())
      return fail(file_, fmt::format("line {} (.header_line) is blank or among the samples", line));
    if (auto header = take(*found)) return checked(std::move(*header), *found);
    return wrong_width(*found);
  }

  expected<Header, Error> find() {
    if (auto header = properties()) return std::move(*header);
    std::size_t i = above_.size();
    while (i > 0 && (above_[i - 1].comment || is_empty(above_[i - 1]))) --i;
    if (i == 0) return comment();
    const TextLine& nearest = above_[i - 1];
    auto header = take(nearest);
    if (!header) {
      if (auto from_comment = comment(); from_comment->line > 0) return from_comment;
      const bool title = fields_of(nearest).size() == 1 && width_ > 1;
      return title ? expected<Header, Error>(Header()) : wrong_width(nearest);
    }
    if (!holds_units(fields_of(nearest)) || i < 2) return checked(std::move(*header), nearest);
    auto names = take(above_[i - 2]);
    if (!names) return checked(std::move(*header), nearest);
    for (auto& unit : header->names) names->units.push_back(without_brackets(std::move(unit)));
    return checked(std::move(*names), above_[i - 2]);
  }

 private:
  /// Fields that all are missing: a row of samples that were not there.
  [[nodiscard]] bool is_empty(const TextLine& line) const {
    const auto fields = fields_of(line);
    return std::all_of(fields.begin(), fields.end(), [](const Field& f) { return says_missing(f.text); });
  }

  [[nodiscard]] std::vector<Field> fields_of(const TextLine& line) const {
    std::string_view text = line.text;
    if (line.comment) text.remove_prefix(std::min(text.find_first_not_of(" \t#"), text.size()));
    return split_fields(separator_, text);
  }

  [[nodiscard]] std::optional<Header> take(const TextLine& line) const {
    const auto fields = fields_of(line);
    if (!fits(fields, width_, ends_empty_)) return std::nullopt;
    return Header{line.number, texts_of(fields), {}};
  }

  [[nodiscard]] expected<Header, Error> checked(Header header, const TextLine& line) const {
    for (const Field& field : fields_of(line))
      if (!field.closed)
        return fail(fmt::format("{}: line {}", file_, line.number),
                    fmt::format("the quote before {} is not closed", in_quotes(as_utf8(field.text))));
    return header;
  }

  [[nodiscard]] unexpected<Error> wrong_width(const TextLine& line) const {
    const auto fields = fields_of(line);
    const bool comma = separator_ == ',' && width_ == 2 * fields.size();
    return fail(
        fmt::format("{}: line {}", file_, line.number + 1),
        fmt::format("has {} field{}, the header (line {}) names {} column{}{}", width_,
                    width_ == 1 ? "" : "s", line.number, fields.size(), fields.size() == 1 ? "" : "s",
                    comma ? ": the comma separates columns and marks decimals; numbers must be written "
                            "with a decimal point, or columns separated by semicolon or tab"
                          : ""));
  }

  /// The last comment that has a field per column.
  [[nodiscard]] expected<Header, Error> comment() const {
    for (std::size_t i = above_.size(); i-- > 0;)
      if (above_[i].comment && width_ > 1 && fields_of(above_[i]).size() == width_) {
        auto header = take(above_[i]);
        if (!holds_units(fields_of(above_[i]))) return *header;
      }
    return Header();
  }

  /// The last such line of the block of properties: label and values, or label and value in turn.
  [[nodiscard]] std::optional<std::vector<std::string>> property(std::string_view label) const {
    std::optional<std::vector<std::string>> found;
    for (const TextLine& line : above_) {
      const auto fields = fields_of(line);
      if (lower(as_utf8(fields.front().text)) != label || fields.size() < 2) continue;
      found = texts_of(fields);
    }
    return found;
  }

  /// A value per column of what a line of properties holds.
  [[nodiscard]] std::vector<std::string> per_column(const std::vector<std::string>& line) const {
    std::vector<std::string> values(width_);
    const bool pairs = line.size() > 3 && line[2] == line[0];
    const bool no_time = pairs ? line.size() / 2 == width_ : line.size() == width_ + 1;
    for (std::size_t i = 1; i < line.size(); i += pairs ? 2 : 1) {
      const std::size_t channel = pairs ? i / 2 : i - 1;
      const bool own_time = pairs ? line.size() >= width_ && width_ == 2 * (line.size() / 2) : false;
      const std::size_t column = own_time ? 2 * channel + 1 : no_time ? channel : channel + 1;
      if (column < width_) values[column] = line[i];
    }
    return values;
  }

  /// `Name;first;Name;second`: without further properties that tells a block.
  [[nodiscard]] static bool in_pairs(const std::vector<std::string>& line) {
    if (line.size() < 4) return false;
    for (std::size_t i = 0; i < line.size(); i += 2)
      if (line[i] != line[0]) return false;
    return true;
  }

  [[nodiscard]] std::optional<Header> properties() const {
    constexpr std::array<std::string_view, 5> kLabels = {"symbolname", "data-type", "sampletime[ms]",
                                                         "variablesize", "symbolcomment"};
    const auto names = property("name");
    const bool block =
        std::any_of(kLabels.begin(), kLabels.end(), [&](auto label) { return property(label).has_value(); });
    if (!names || !(block || in_pairs(*names))) return std::nullopt;
    Header header;
    for (const TextLine& line : above_)
      if (texts_of(fields_of(line)) == *names) header.line = line.number;
    header.names = per_column(*names);
    header.units.resize(width_);
    if (const auto units = property("unit")) header.units = per_column(*units);
    header.sample_interval_s = interval();
    for (std::size_t i = 0; i < width_; ++i)
      if (header.names[i].empty()) {
        header.names[i] = "time";
        if (header.units[i].empty()) header.units[i] = "ms";
      }
    return header;
  }

  /// Of the first channel.
  [[nodiscard]] double interval() const {
    const auto line = property("sampletime[ms]");
    const auto value = line && line->size() > 1 ? parse_decimal((*line)[1], '.') : std::nullopt;
    return value && *value > 0.0 ? 1e-3 * *value : 0.0;
  }

  const std::string& file_;
  std::span<const TextLine> above_;
  std::size_t width_;
  bool ends_empty_;
  char separator_;
};

}  // namespace

double told_interval(std::span<const TextLine> above) {
  for (const TextLine& line : above) {
    const std::string text = lower(line.text);
    constexpr std::string_view kPhrase = "sampling period is ";
    const std::size_t at = text.find(kPhrase);
    if (at == text.npos) continue;
    const auto words = split_fields(kBlanks, std::string_view(text).substr(at + kPhrase.size()));
    if (words.size() < 2) continue;
    const auto value = parse_decimal(words[0].text, '.');
    const auto unit = known_unit(words[1].text);
    if (value && *value > 0.0 && unit && unit->dimension == Dimension::time) return *value * unit->factor;
  }
  return 0.0;
}

expected<Header, Error> find_header(const std::string& file, std::span<const TextLine> above,
                                    const RowWidth& width, char separator, std::optional<std::size_t> named) {
  HeaderFinder finder(file, above, width, separator);
  return named ? finder.named(*named) : finder.find();
}

}  // namespace resonid::io
