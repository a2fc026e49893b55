// SPDX-License-Identifier: MIT
// Requests of the monitor's web server: where they end, their head, query, names and bodies, up to the
// answer.
#include <string>

#include "../tests/unit/monitor_web/fake_backend.hpp"
#include "input_file.hpp"
#include "monitor/web/api.hpp"
#include "monitor/web/framing.hpp"
#include "monitor/web/questions.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace resonid;
  using namespace resonid::monitor;
  static test::FakeBackend backend;
  static const auto answer =
      make_answerer({backend, {}, [] { return WebCounts{}; }, [] { return test::kTime; }});
  const std::string text(reinterpret_cast<const char*>(data), size);
  static_cast<void>(action_of(ActionKind::shelve, text, test::kTime));
  fuzz::require(!is_axis_name(text) || (text.find('/') == std::string::npos && text != ".."));

  const auto sized = request_size(text, {});
  fuzz::require(sized.refusal == 0 || sized.head == 0);
  if (sized.head == 0 || sized.head + sized.body > size) return 0;
  const auto reply = answer(text.substr(0, sized.head + sized.body), sized.head, "192.0.2.1");
  fuzz::require(reply.text.starts_with("HTTP/1.1 ") && reply.status >= 200 && reply.status < 600);
  // What came in is nowhere in the head of what goes out, or a line end in it would begin a header.
  fuzz::require(reply.text.find("\r\nInjected:") == std::string::npos);
  return 0;
}
