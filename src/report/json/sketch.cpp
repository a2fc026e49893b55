// SPDX-License-Identifier: MIT
#include <list>

#include "report/json/passes.hpp"

namespace resonid::report {
namespace {

struct TypeName {
  std::string operator()(const double*) const { return "number"; }
  std::string operator()(const int*) const { return "integer"; }
  std::string operator()(const std::size_t*) const { return "count"; }
  std::string operator()(const bool*) const { return "boolean"; }
  std::string operator()(const std::string*) const { return "string"; }
  std::string operator()(const Chosen*) const { return "choice"; }
  std::string operator()(const std::vector<double>*) const { return "numbers"; }
  std::string operator()(const std::vector<int>*) const { return "integers"; }
  std::string operator()(const std::vector<bool>*) const { return "booleans"; }
  std::string operator()(const std::vector<std::string>*) const { return "strings"; }
  std::string operator()(const Eigen::MatrixXd*) const { return "matrix"; }
  std::string operator()(const Gaps*) const { return "rows"; }
};

class Sketcher final : public Fields {
 public:
  explicit Sketcher(Sketch& root) : Fields(Pass::sketch), at_{&root} {}

  /// A file of its own within a kind is that kind: what follows of it is told at its own place.
  void schema(std::initializer_list<std::string_view> names) override {
    if (!in_kind()) {
      here().schema = *names.begin();
      return;
    }
    Sketch file;
    file.type = "file";
    file.schema = *names.begin();
    add(std::move(file));
    if (muted_ == 0) muted_ = in_kind_.size();
  }

 protected:
  bool leaf(const Key& key, Presence presence, Value value, bool) override {
    Sketch part = part_of(key, presence, std::visit(TypeName{}, value));
    if (const auto* chosen = std::get_if<Chosen*>(&value))
      part.names.assign((*chosen)->names.begin(), (*chosen)->names.end());
    add(std::move(part));
    return true;
  }
  bool open(const Key& key, Presence presence, bool) override {
    at_.push_back(&add(part_of(key, presence, "object")));
    return true;
  }
  void close() override { at_.pop_back(); }
  std::optional<std::size_t> open_list(const Key& key, Presence presence, std::size_t, bool) override {
    at_.push_back(&add(part_of(key, presence, "list")));
    return 1;
  }
  void open_element(std::size_t) override {}
  void close_element() override {}
  void close_list() override { at_.pop_back(); }
  [[nodiscard]] std::vector<std::string> further(const std::vector<std::string>&) override { return {"*"}; }
  void begin_kind(std::size_t) override {
    here().kinds.emplace_back();
    in_kind_.push_back(&here());
  }
  void end_kind() override {
    in_kind_.pop_back();
    if (in_kind_.size() < muted_) muted_ = 0;
  }

 private:
  [[nodiscard]] Sketch& here() noexcept { return *at_.back(); }
  [[nodiscard]] bool in_kind() noexcept { return !in_kind_.empty() && in_kind_.back() == &here(); }
  static Sketch part_of(const Key& key, Presence presence, std::string type) {
    return {std::string(key.name),
            std::string(key.meaning),
            std::string(key.unit),
            presence,
            key.range,
            std::move(type),
            {},
            {},
            {},
            {}};
  }
  Sketch& add(Sketch part) {
    if (muted_ > 0) return passed_over_.emplace_back(std::move(part));
    auto& parts = in_kind() ? here().kinds.back() : here().parts;
    return parts.emplace_back(std::move(part));
  }

  std::vector<Sketch*> at_;       // open ones; a parent gets no further part while a child is open
  std::vector<Sketch*> in_kind_;  // those of which a kind is being described
  std::size_t muted_ = 0;         // kinds that were open when the last file of its own began; 0: none
  std::list<Sketch> passed_over_;
};

}  // namespace

Sketch sketch(const std::function<void(Fields&)>& description) {
  Sketch root;
  root.type = "object";
  Sketcher sketcher(root);
  description(sketcher);
  return root;
}

}  // namespace resonid::report
