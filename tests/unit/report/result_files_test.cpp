// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <resonid/base/error_text.hpp>
#include <resonid/identification/compare.hpp>
#include <resonid/identification/track.hpp>
#include <resonid/identification/tune.hpp>
#include <resonid/identification/validate.hpp>
#include <resonid/planning/plan.hpp>
#include <resonid/report/detail/batch.hpp>
#include <resonid/report/detail/inspection.hpp>
#include <resonid/report/detail/truth.hpp>
#include <resonid/report/json.hpp>
#include <string>

// Files that earlier programs wrote (tests/fixtures/results) are still read, and written again with every key
// and value that they hold.
namespace resonid::report {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string text_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// What the file holds, read as T and written again.
template <class T>
json again(const json& file) {
  const auto read = from_json<T>(file);
  if (!read) throw std::runtime_error(message_of(read.error()));
  return to_json(*read);
}

json again(const json& file) {
  static const std::map<std::string, std::function<json(const json&)>> kKinds = {
      {"resonid.identification/1", again<identification::Result>},
      {"resonid.identifications/1", again<BatchResult>},
      {"resonid.track/1", again<identification::Track>},
      {"resonid.validation/1", again<identification::ModelValidation>},
      {"resonid.comparison/1", again<identification::Changes>},
      {"resonid.inspection/1", again<FileInspection>},
      {"resonid.plan/1", again<planning::Plan>},
      {"resonid.tuning/1", again<identification::Tuning>},
      {"resonid.truth/1", again<SimulatedTruth>}};
  return kKinds.at(file.at("schema").get<std::string>())(file);
}

/// The first place at which two texts differ; numbers may by rounding, as what follows from others of the
/// file is computed again.
std::string difference(const json& a, const json& b, const std::string& path = "$") {
  constexpr double kRounding = 1e-9;
  if (a.is_number() && b.is_number()) {
    const double x = a.get<double>(), y = b.get<double>();
    const bool same = std::abs(x - y) <= kRounding * std::max(std::abs(x), std::abs(y));
    return same ? "" : path + ": " + a.dump() + " and " + b.dump();
  }
  if (a.type() != b.type()) return path + ": " + a.dump() + " and " + b.dump();
  if (a.is_array()) {
    if (a.size() != b.size())
      return path + ": " + std::to_string(a.size()) + " and " + std::to_string(b.size());
    for (std::size_t i = 0; i < a.size(); ++i)
      if (auto d = difference(a[i], b[i], path + "[" + std::to_string(i) + "]"); !d.empty()) return d;
    return {};
  }
  if (!a.is_object()) return a == b ? "" : path + ": " + a.dump() + " and " + b.dump();
  for (const auto& [key, value] : a.items()) {
    if (!b.contains(key)) return path + "." + key + " is lost";
    if (auto d = difference(value, b.at(key), path + "." + key); !d.empty()) return d;
  }
  for (const auto& [key, value] : b.items())
    if (!a.contains(key)) return path + "." + key + " is new";
  return {};
}

TEST(ResultFiles, AreReadAndWrittenAgain) {
  std::size_t count = 0;
  for (const auto& entry : fs::directory_iterator(RESONID_FIXTURES_DIR "/results")) {
    if (entry.path().extension() != ".json") continue;
    ++count;
    const json file = json::parse(text_of(entry.path()));
    SCOPED_TRACE(entry.path().filename().string());
    try {
      EXPECT_EQ(difference(file, again(file)), "");
    } catch (const std::exception& error) {
      ADD_FAILURE() << error.what();
    }
  }
  EXPECT_GE(count, 40U);
}

TEST(ResultFiles, OfAnotherKindAreRefused) {
  const json plan = json::parse(text_of(RESONID_FIXTURES_DIR "/results/plan_prbs.json"));
  const auto track = from_json<identification::Track>(plan);
  ASSERT_FALSE(track);
  EXPECT_EQ(message_of(track.error()), "$.schema: found \"resonid.plan/1\", required \"resonid.track/1\"");
}

TEST(ResultFiles, NameThePlaceThatIsWrong) {
  const auto message = [](const char* name, const char* pointer, const json& value) {
    json file = json::parse(text_of(RESONID_FIXTURES_DIR "/results/" + std::string(name)));
    file[json::json_pointer(pointer)] = value;
    try {
      static_cast<void>(again(file));
    } catch (const std::exception& error) {
      return std::string(error.what());
    }
    return std::string("nothing is wrong");
  };
  EXPECT_EQ(message("track_arx.json", "/trust/all", "most"),
            "$.trust.all: found \"most\", required a number");
  EXPECT_EQ(message("validate.json", "/verdict", "good"),
            "$.verdict: found \"good\", required one of \"accepted\", \"doubtful\", \"rejected\"");
  EXPECT_EQ(message("compare.json", "/parameters/0/change", nullptr),
            "$.parameters[0].change: found null, required a number");
  EXPECT_EQ(message("plan_chirp.json", "/excitation", 1.0), "$.excitation: found 1.0, required an object");
  EXPECT_EQ(message("truth_chain.json", "/model/parameters/couplings/0/between", json{0}),
            "$.model.parameters.couplings[0].between: found an array of 1, required two whole numbers >= 0");
  EXPECT_EQ(message("batch.json", "/table/figures/0/values/0/record", -1),
            "$.table.figures[0].values[0].record: found -1, required a whole number >= 0");
}

/// Every value of a file in turn is taken away or made into something else: what comes is refused in words or
/// can be written. Beside `make fuzz`, whose target for these files takes most stages with it and so has no
/// place in CI.
TEST(ResultFiles, AreRefusedInWordsOrCanBeWritten) {
  const json kOthers[] = {nullptr, true, -1, 1e308, "", "nan", json::array(), json::object(), json{{{}, {}}}};
  std::mt19937_64 generator(1);
  std::size_t refused = 0, taken = 0;
  for (const char* name : {"batch", "compare_bootstrap", "identify_black_box", "identify_three_mass", "join",
                           "plan_multisine", "track_lines", "truth_chain", "tune_design", "validate"}) {
    const json file = json::parse(text_of(RESONID_FIXTURES_DIR "/results/" + std::string(name) + ".json"));
    const json places = file.flatten();
    constexpr std::size_t kTries = 150;
    for (std::size_t i = 0; i < kTries; ++i) {
      auto place =
          json::json_pointer(std::next(places.items().begin(), long(generator() % places.size())).key());
      for (auto up = generator() % 3; up > 0 && !place.parent_pointer().empty(); --up)
        place = place.parent_pointer();
      json changed = file;
      if (const auto other = generator() % (std::size(kOthers) + 1); other < std::size(kOthers))
        changed[place] = kOthers[other];
      else if (auto& holder = changed[place.parent_pointer()]; holder.is_object())
        holder.erase(place.back());
      else
        holder.erase(holder.size() - 1);
      try {
        static_cast<void>(again(changed).dump());
        ++taken;
      } catch (const std::runtime_error& error) {
        ++refused;
        EXPECT_EQ(std::string(error.what()).substr(0, 1), "$") << name << ' ' << place.to_string();
      } catch (const json::exception&) {  // `schema` itself, which this test looks at first
        EXPECT_EQ(place.to_string(), "/schema");
      } catch (const std::out_of_range&) {
        EXPECT_EQ(place.to_string(), "/schema");
      }
    }
  }
  EXPECT_GT(refused, 500U);
  EXPECT_GT(taken, 50U);
}

/// docs/results.md and docs/schema come from the descriptions. With RESONID_WRITE_DOCS in the environment
/// they are written instead.
TEST(ResultFiles, AreDocumented) {
  const fs::path docs = RESONID_DOCS_DIR;
  const auto matches = [&](const fs::path& path, const std::string& contents) {
    if (std::getenv("RESONID_WRITE_DOCS") != nullptr) std::ofstream(path, std::ios::binary) << contents;
    EXPECT_EQ(text_of(path), contents) << path;
  };
  matches(docs / "results.md", results_document());
  for (const auto& kind : result_kinds())
    matches(docs / "schema" / (kind + ".json"), json_schema(kind).dump(1) + "\n");
}

}  // namespace
}  // namespace resonid::report
