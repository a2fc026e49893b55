// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "report/json/json_place.hpp"
#include "report/json/passes.hpp"

namespace resonid::report {
namespace {

using nlohmann::json;

double number(const JsonPlace& place, Range range) {
  switch (range) {
    case positive:
      return place.positive();
    case not_negative:
      return place.not_negative();
    case any:
      break;
  }
  return place.number();
}

class Reader final : public Fields {
 public:
  Reader(const json& root, JsonProblems& problems) : Fields(Pass::read), problems_(problems) {
    at_.push_back({JsonPlace(root, problems), {}});
  }

  void schema(std::initializer_list<std::string_view> names) override {
    if (stopped_) return;
    std::vector<std::string> known(names.begin(), names.end());
    const std::size_t before = problems_.size();
    static_cast<void>(here().at("schema").choice(known));
    at_.back().known.insert("schema");
    stopped_ = stopped_ || problems_.size() > before;
  }
  [[nodiscard]] bool holds(std::string_view name) const override {
    return at_.back().place.maybe(std::string(name)).present();
  }
  [[nodiscard]] bool says(std::string_view name, std::string_view text) const override {
    return at_.back().place.maybe(std::string(name)).is(std::string(text));
  }
  void require(bool ok, std::string_view name, const std::string& requirement) override {
    if (!ok && !stopped_) here().refuse(std::string(name), requirement);
  }

 protected:
  bool leaf(const Key& key, Presence presence, Value value, bool) override {
    const JsonPlace place = find(key, presence);
    if (place.present()) std::visit([&](auto* v) { get(place, key.range, *v); }, value);
    return place.present();
  }
  bool open(const Key& key, Presence presence, bool) override {
    const JsonPlace place = find(key, presence);
    if (place.present()) at_.push_back({place, {}});
    return place.present();
  }
  void close() override { at_.pop_back(); }
  std::optional<std::size_t> open_list(const Key& key, Presence presence, std::size_t, bool) override {
    const JsonPlace place = find(key, presence);
    if (!place.present()) return std::nullopt;
    lists_.push_back(place.elements());
    return lists_.back().size();
  }
  void open_element(std::size_t index) override { at_.push_back({lists_.back()[index], {}}); }
  void close_element() override { at_.pop_back(); }
  void close_list() override { lists_.pop_back(); }
  [[nodiscard]] std::vector<std::string> further(const std::vector<std::string>&) override {
    std::vector<std::string> names;
    for (const auto& name : here().keys())
      if (!at_.back().known.contains(name)) names.push_back(name);
    return names;
  }

 private:
  struct Level {
    JsonPlace place;
    std::set<std::string> known;  // keys that have been described
  };
  [[nodiscard]] const JsonPlace& here() const noexcept { return at_.back().place; }
  [[nodiscard]] JsonPlace find(const Key& key, Presence presence) {
    if (stopped_) return here().none();
    const std::string name(key.name);
    at_.back().known.insert(name);
    return presence == Presence::required ? here().at(name) : here().maybe(name);
  }

  static void get(const JsonPlace& p, Range range, double& v) { v = number(p, range); }
  static void get(const JsonPlace& p, Range, int& v) { v = p.whole(); }
  static void get(const JsonPlace& p, Range, std::size_t& v) { v = p.count(); }
  static void get(const JsonPlace& p, Range, bool& v) { v = p.flag(); }
  static void get(const JsonPlace& p, Range, std::string& v) { v = p.text(); }
  static void get(const JsonPlace& p, Range, Chosen& v) {
    v.index = p.choice({v.names.begin(), v.names.end()});
  }
  static void get(const JsonPlace& p, Range range, std::vector<double>& v) {
    v.clear();
    for (const auto& e : p.elements()) v.push_back(number(e, range));
  }
  static void get(const JsonPlace& p, Range, std::vector<int>& v) {
    v.clear();
    for (const auto& e : p.elements()) v.push_back(e.whole());
  }
  static void get(const JsonPlace& p, Range, std::vector<bool>& v) {
    v.clear();
    for (const auto& e : p.elements()) v.push_back(e.flag());
  }
  static void get(const JsonPlace& p, Range, std::vector<std::string>& v) {
    v.clear();
    for (const auto& e : p.elements()) v.push_back(e.text());
  }
  static void get(const JsonPlace& p, Range, Gaps& v) {
    v.value.clear();
    for (const auto& e : p.elements())
      v.value.push_back(e.null() ? std::numeric_limits<double>::quiet_NaN() : e.number());
  }
  /// Of the size that the matrix has.
  static void get(const JsonPlace& p, Range, Eigen::MatrixXd& m) {
    const auto rows = p.elements();
    const auto height = static_cast<std::size_t>(m.rows()), width = static_cast<std::size_t>(m.cols());
    m.setZero();
    if (rows.size() != height) p.refuse(fmt::format("{} rows", height));
    for (std::size_t i = 0; i < std::min(rows.size(), height); ++i) {
      const auto row = rows[i].numbers();
      if (row.size() != width) rows[i].refuse(fmt::format("{} numbers", width));
      for (std::size_t k = 0; k < std::min(row.size(), width); ++k)
        m(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) = row[k];
    }
  }

  JsonProblems& problems_;
  std::vector<Level> at_;
  std::vector<std::vector<JsonPlace>> lists_;
  bool stopped_ = false;  // another kind of file: nothing more is to be said of it
};

}  // namespace

expected<void> read(const json& json, const std::function<void(Fields&)>& description) {
  JsonProblems problems;
  Reader reader(json, problems);
  description(reader);
  if (problems.empty()) return {};
  return unexpected(error_of(problems));
}

}  // namespace resonid::report
