// SPDX-License-Identifier: GPL-3.0-or-later
// Compares two models of an object over its surface, on threads of its own, while the session goes on.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "hybrid/program/view/view_command.h"
#include "hybrid/program/view/viewed_scene.h"

namespace hybrid {

class ModelDifference {
 public:
  // `beside`: a session runs at the same time, so the threads have the lowest priority.
  ModelDifference(const ViewCommand& command, bool beside) : command_(command), beside_(beside) {}
  ModelDifference(const ModelDifference&) = delete;
  ModelDifference& operator=(const ModelDifference&) = delete;
  ModelDifference(ModelDifference&&) = delete;
  ModelDifference& operator=(ModelDifference&&) = delete;
  ~ModelDifference() { stop(); }

  // Ends an earlier comparison, and begins one in the scene that is shown, with the values of the snapshot.
  // If `comparison` has no object, none begins, and the result of the earlier one stays.
  void ask(const ModelComparison& comparison, const ViewedScene& viewed, const Snapshot& now);
  // Ends a comparison and drops its result. Call it when another scene is shown.
  void forget();
  // Waits for the end of a comparison.
  void wait();

  // The result so far; null: none.
  [[nodiscard]] std::shared_ptr<const FeltDifference> found() const;
  // The progress, in words; empty: nothing is compared.
  [[nodiscard]] std::string in_words() const;
  // Returns the reason why the models could not be compared, and forgets it. Empty if there is none.
  [[nodiscard]] std::string take_error();

 private:
  struct NamedEdit {
    std::string object;  // empty: the tool
    EditedQuantity quantity = EditedQuantity::coupling_stiffness;
    double value = 0.0;
  };
  struct Job {
    ModelComparison comparison;
    std::string text;               // of the scene
    std::vector<NamedEdit> edits;   // values that differ from those of the text
    polygon::TriangleMesh surface;  // of the object
    std::size_t object = 0;         // of DrawnScene::objects
    double floor_N = 0.0;           // of the JND
  };

  void stop();
  void run(const Job& job);
  [[nodiscard]] BuiltScene build(const Job& job, const std::vector<SceneChange>& changes, const char* name);
  void say(std::string words);

  const ViewCommand& command_;
  bool beside_;
  std::uint64_t comparisons_ = 0, numbers_ = 0;
  std::atomic<bool> stop_{false};
  mutable std::mutex guard_;  // protects the next three members
  std::shared_ptr<const FeltDifference> found_;
  std::string words_, error_;
  std::thread thread_;
};

}  // namespace hybrid
