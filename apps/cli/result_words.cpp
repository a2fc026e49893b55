// SPDX-License-Identifier: MIT
#include "result_words.hpp"

#include "option_names.hpp"

namespace resonid::cli {
namespace {

void put_in_options(std::string& text) { text = in_options(std::string_view(text)); }

void put_in_options(std::vector<diagnostics::Finding>& findings) {
  for (auto& f : findings) put_in_options(f.meaning);
}

}  // namespace

void put_in_options(std::vector<std::string>& sentences) {
  for (auto& sentence : sentences) put_in_options(sentence);
}

void put_in_options(identification::Result& result) {
  put_in_options(result.findings);
  for (auto& c : result.choices) put_in_options(c.because);
  for (auto& s : result.structures) put_in_options(s.remark);
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
  put_in_options(track.findings);
  put_in_options(track.reason);
}
void put_in_options(identification::ModelValidation& validation) { put_in_options(validation.findings); }
void put_in_options(identification::Changes& changes) { put_in_options(changes.findings); }

}  // namespace resonid::cli
