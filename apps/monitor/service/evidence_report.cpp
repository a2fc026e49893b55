// SPDX-License-Identifier: MIT
#include "monitor/service/evidence_report.hpp"

#include <fstream>
#include <resonid/base/error_text.hpp>
#include <resonid/resonid.hpp>
#include <sstream>

namespace resonid::monitor {

io::ColumnMapping evidence_columns(const InstalledAxis& axis) {
  const auto& spec = axis.spec;
  io::ColumnMapping columns;
  columns.input_scale = spec.input_scale;
  columns.output_scale = spec.output_scale;
  columns.motion = spec.motion;
  columns.output_quantity = spec.output_quantity;
  if (!spec.input_unit.empty()) columns.input_unit = spec.input_unit;
  if (!spec.output_unit.empty()) columns.output_unit = spec.output_unit;
  return columns;
}

expected<std::string, std::string> evidence_report(const InstalledAxis& axis,
                                                   const std::filesystem::path& file) {
  const auto record = io::read_record(file, evidence_columns(axis));
  if (!record) return tl::unexpected(message_of(record.error()));
  const auto result = identify(*record, axis.spec.track.common);
  if (!result) return tl::unexpected(message_of(result.error()));
  auto page = file;
  page.replace_extension(".html");
  if (const auto written = write_report(page, *result, *record); !written)
    return tl::unexpected(message_of(written.error()));
  std::ifstream html(page, std::ios::binary);
  std::ostringstream text;
  text << html.rdbuf();
  return text.str();
}

}  // namespace resonid::monitor
