// SPDX-License-Identifier: GPL-3.0-or-later
// The editor of a scene's text changes only the value, wherever the table stands.
#include "hybrid/scene/edit_text.h"

#include <gtest/gtest.h>

namespace {

using hybrid::SceneTextEditor;
using hybrid::TextTable;

struct EditCase {
  std::string before;
  TextTable table;
  std::string key, value, after;
};

TEST(EditText, AValueIsReplacedOrAddedWhereverTheTableStands) {
  const std::vector<EditCase> cases{
      {"[tool]\nradius = 2 # mm\n", {"tool"}, "radius", "3", "[tool]\nradius = 3 # mm\n"},
      {"[tool] # t\nradius = 2\n", {"tool"}, "stiffness", "5", "[tool] # t\nstiffness = 5\nradius = 2\n"},
      {"[tool]", {"tool"}, "radius", "3", "[tool]\nradius = 3"},
      {"a = 1\n", {"tool"}, "radius", "3", "a = 1\n\n[tool]\nradius = 3\n"},
      {"a = 1\r\n", {"tool"}, "radius", "3", "a = 1\r\n\r\n[tool]\r\nradius = 3\r\n"},
      {"tool = { a = [1, # }\n 2], b = 2 }\n",
       {"tool"},
       "c",
       "3",
       "tool = { a = [1, # }\n 2], c = 3, b = 2 }\n"},
      {"tool = { a = { b = '}' } }\n", {"tool"}, "c", "3", "tool = { a = { b = '}' }, c = 3 }\n"},
      {"  [[soft]]\n  size = 2 # s\n  name = \"#]\" # n\r\n",
       {"soft", "#]"},
       "spacing",
       "[1, 2, 3]",
       "  [[soft]]\n  size = 2 # s\n  name = \"#]\" # n\r\n  spacing = [1, 2, 3]\r\n"},
      {"[[rigid]]\nname = 'x'\n[[rigid]]\nname = 'y'\n[rigid.texture]\nheight = 1\n",
       {"rigid", "y", "texture"},
       "height",
       "2",
       "[[rigid]]\nname = 'x'\n[[rigid]]\nname = 'y'\n[rigid.texture]\nheight = 2\n"},
      {"[material.fat]\nyoung = 1\n[material.gel]\nyoung = 1\n",
       {"material", "", "gel"},
       "young",
       "2",
       "[material.fat]\nyoung = 1\n[material.gel]\nyoung = 2\n"},
      {"[material]\ngel = { poisson = 0.3 }\n",
       {"material", "", "gel"},
       "young",
       "2",
       "[material]\ngel = { poisson = 0.3, young = 2 }\n"},
      {"[tool]\na = [\n 1, # one ]\n 2 ] # e\n", {"tool"}, "a", "7", "[tool]\na = 7 # e\n"},
      {"[tool]\na = \"\"\"\n[x]\n\"\"\" # e\n", {"tool"}, "a", "7", "[tool]\na = 7 # e\n"},
  };
  for (const EditCase& c : cases) {
    SceneTextEditor editor(c.before, "a.toml");
    EXPECT_EQ(editor.set(c.table, c.key, c.value), "") << c.before;
    EXPECT_EQ(editor.text(), c.after);
  }
}

TEST(EditText, WhatCannotBeChangedStaysAndIsSaid) {
  const std::vector<EditCase> cases{
      {"tool.radius = 2\n", {"tool"}, "stiffness", "5", "its place in the text was not found"},
      {"[tool]\nradius = 2\n", {"tool"}, "stiffness", "5 6", "its place in the text was not found"},
      {"[[soft]]\nname = 'a'\n", {"soft", "b"}, "spacing", "5", "its table is not in the scene's text"},
      {"[material.fat]\nyoung = 1\n",
       {"material", "", "gel"},
       "young",
       "5",
       "its table is not in the scene's text"},
      {"[tool]\nradius = { a = 1 }\n", {"tool"}, "radius", "5", "it is written as a table"},
  };
  for (const EditCase& c : cases) {
    SceneTextEditor editor(c.before, "a.toml");
    EXPECT_EQ(editor.set(c.table, c.key, c.value), c.after);
    EXPECT_EQ(editor.text(), c.before);
  }
}

TEST(EditText, CommentsAreAddedOnceAndRemoved) {
  const std::string text = "# mark: no\n[[soft]]\n  name = 'a'\n  spacing = 2\n";
  SceneTextEditor editor(text, "a.toml");
  const TextTable table{"soft", "a"};
  EXPECT_TRUE(editor.comment_above(table, {"spacing"}, "# my: why"));
  EXPECT_EQ(editor.text(), "# mark: no\n[[soft]]\n  name = 'a'\n  # my: why\n  spacing = 2\n");
  const std::string once = editor.text();
  EXPECT_TRUE(editor.comment_above(table, {"spacing"}, "# my: why"));
  EXPECT_EQ(editor.text(), once);
  EXPECT_FALSE(editor.comment_above(table, {"energy"}, "# my: why"));
  editor.remove_comments("# my: ");
  EXPECT_EQ(editor.text(), text);
}

// A line within a string is no comment.
TEST(EditText, StringsThatLookLikeCommentsStay) {
  const std::string text = "title = \"\"\"\n# my: x\n\"\"\"\n";
  SceneTextEditor editor(text, "a.toml");
  editor.remove_comments("# my: ");
  EXPECT_EQ(editor.text(), text);
}

}  // namespace
