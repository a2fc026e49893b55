// SPDX-License-Identifier: MIT
#include "result_words.hpp"

#include "option_names.hpp"

namespace resonid::cli {
namespace {

void translate(std::string& text) { text = in_options(std::string_view(text)); }

void translate(std::vector<diagnostics::Finding>& findings) {
  for (auto& f : findings) translate(f.meaning);
}

}  // namespace

void put_in_options(std::vector<std::string>& sentences) {
  for (auto& sentence : sentences) translate(sentence);
}

void put_in_options(std::vector<diagnostics::Finding>& findings) { translate(findings); }

void put_in_options(identification::Result& result) {
  put_in_options(result.record.reading);
  translate(result.findings);
  for (auto& c : result.choices) translate(c.because);
  for (auto& s : result.structures) translate(s.remark);
}

void put_in_options(report::BatchResult& result) {
  for (auto& entry : result.batch.entries) {
    if (entry.result)
      put_in_options(*entry.result);
    else
      entry.error = Error{{}, in_options(entry.error)};
  }
  if (result.joint) put_in_options(result.joint->result);
}

void put_in_options(identification::Track& track) {
  put_in_options(track.record.reading);
  translate(track.findings);
  translate(track.reason);
}
void put_in_options(identification::ModelValidation& validation) {
  put_in_options(validation.record.reading);
  translate(validation.findings);
}
void put_in_options(identification::Changes& changes) { translate(changes.findings); }
void put_in_options(identification::Tuning& tuning) { translate(tuning.findings); }

}  // namespace resonid::cli
