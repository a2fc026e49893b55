// SPDX-License-Identifier: MIT
#include "monitor/service/evidence_report.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <ctime>
#include <nlohmann/json.hpp>
#include <resonid/base/error_text.hpp>
#include <resonid/io/detail/atomic_file.hpp>
#include <resonid/io/detail/sha256.hpp>
#include <resonid/report/detail/page.hpp>
#include <resonid/report/detail/provenance.hpp>
#include <resonid/report/json.hpp>
#include <resonid/resonid.hpp>

#include "cli/option_names.hpp"
#include "monitor/service/raw_csv.hpp"

namespace resonid::monitor {
namespace {

/// Where the file lies on this machine is no reader's business.
std::string without_folder(std::string text, const std::filesystem::path& file) {
  const std::string folder = (file.parent_path() / "").string();
  for (auto at = text.find(folder); !folder.empty() && at != std::string::npos; at = text.find(folder, at))
    text.erase(at, folder.size());
  return text;
}

/// With the command that makes the report of the file as a person downloads it.
report::Provenance provenance_of_evidence(const InstalledAxis& axis, const std::string& name,
                                          const std::string& version, const std::string& sha256) {
  InstalledAxis told = axis;
  if (const std::filesystem::path controller = told.controller; controller.is_absolute())
    told.controller = controller.filename().string();
  report::Provenance p;
  p.version = version;
  p.command = identify_command(told, name);
  p.date = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
  p.files.push_back({name, sha256});
  return p;
}

}  // namespace

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

expected<std::string, NoReport> evidence_report(const InstalledAxis& axis, const std::filesystem::path& file,
                                                const std::string& version) {
  const auto hash = [&file] { return io::sha256_of_file(file.string()).value_or(""); };
  const std::string sha256 = hash();
  const auto why_not = [&](const Error& error) {
    // The options are those of the command that a person would repeat it with.
    return tl::unexpected(NoReport{without_folder(cli::in_options(error), file), hash() == sha256});
  };
  auto record = io::read_record(file, evidence_columns(axis));
  if (!record) return why_not(record.error());
  const std::string name = downloaded_name(file.stem().string());
  record->source = name;
  const auto result = identify(*record, axis.spec.track.common);
  if (!result) return why_not(result.error());
  auto data = report::page_json(*result, *record);
  report::put_provenance(data, provenance_of_evidence(axis, name, version, sha256));
  std::string page = report::page(data);
  if (hash() != sha256) return page;  // there is more now, which the next report is made of
  if (const auto written =
          io::write_file_atomically(std::filesystem::path(file).replace_extension(".html"), page);
      !written)
    return tl::unexpected(NoReport{without_folder(message_of(written.error()), file), false});
  return page;
}

}  // namespace resonid::monitor
