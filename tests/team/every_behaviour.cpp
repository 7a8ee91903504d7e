// Every behaviour of a small team, turn after turn: the earliest turn in which each obstacle is
// resolved. Plain breadth-first search over joint states, without a bound, a plan or a path: nothing
// that the product does. Robots do not collide.
//
// A robot in its turn stays, begins a step to a side, or is on its way; a step of d ticks that it
// begins in tick t ends in its turn of tick t + d - 1. Until then it is where it began. In each
// turn, at its end, a robot does all that it can where it is, but for loads (a need that is followed
// by one of the same robots): it takes those last, alone or with others that are there, or leaves
// them. One robot may have targets, to be met one after the other: each at the end of a turn in which
// it is there and not on its way.
//
// One question a line, as numbers (every_behaviour.py writes them); one answer a line:
// "states turn... targets" with -1 for never; the last turn is the one in which all targets can be
// met.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

namespace {

int rows, cols, count, gates, begin, walker;
std::vector<std::vector<char>> targets;  // of that robot
long most;
std::vector<char> wall;

struct Robot {
  int heading, ticks, region, face, to, facing, left;
  unsigned skills;
} robots[8];

struct Need {
  unsigned skills;
  int robots, together, same;
  std::vector<char> where;
};

struct Gate {
  int region, stage;
  unsigned done, group;
  std::vector<Need> needs;
  std::vector<unsigned> closed;
} all[8];

// Bytes: of each robot region, face, region and face that it goes to, ticks that are left; of each
// obstacle stage, who has done a part, who met the need before.
struct State {
  uint8_t at[48];
};
int used;

uint8_t *robot(State &s, int i) { return s.at + 5 * i; }
uint8_t *gate(State &s, int g) { return s.at + 5 * count + 3 * g; }
uint8_t *met(State &s) { return s.at + 5 * count + 3 * gates; }

struct Seen {  // open addressing
  std::vector<State> table;
  std::vector<char> full;
  size_t size = 0;
  Seen() : table(1024), full(1024, 0) {}
  static uint64_t hash(const State &s) {
    uint64_t h = 1469598103934665603ull;
    for (int i = 0; i < used; i++) h = (h ^ s.at[i]) * 1099511628211ull;
    return h ^ (h >> 29);
  }
  bool add(const State &s) {
    if (2 * size >= table.size()) {
      Seen larger;
      larger.table.resize(4 * table.size());
      larger.full.assign(4 * table.size(), 0);
      for (size_t k = 0; k < table.size(); k++)
        if (full[k]) larger.add(table[k]);
      *this = static_cast<Seen &&>(larger);
    }
    size_t mask = table.size() - 1, k = hash(s) & mask;
    while (full[k]) {
      if (!memcmp(table[k].at, s.at, used)) return false;
      k = (k + 1) & mask;
    }
    table[k] = s, full[k] = 1, size++;
    return true;
  }
};

std::vector<int> first;  // the turn of each obstacle, or -1
int last_target;         // the turn of the last target, or -1

bool takes(State &s, int g) {
  const std::vector<Need> &needs = all[g].needs;
  size_t stage = gate(s, g)[0];
  return stage + 1 < needs.size() && needs[stage + 1].same && !needs[stage].same;
}

bool there(State &s, int g, int j) {
  const uint8_t *now = gate(s, g);
  const Need &need = all[g].needs[now[0]];
  return (need.skills & ~robots[j].skills) == 0 && need.where[robot(s, j)[0]] &&
         (!need.same || (now[2] >> j & 1));
}

// The robots that have had a part in a need: those of the group, and all that had one before.
void meet(State &s, int g, unsigned group) {
  uint8_t *now = gate(s, g);
  const Need &need = all[g].needs[now[0]];
  if (!need.together) group |= now[1];
  if (__builtin_popcount(group) >= need.robots)
    now[0]++, now[1] = 0, now[2] = group;
  else if (!need.together)
    now[1] = group;
}

unsigned those_there(State &s, int g) {
  unsigned found = 0;
  for (int j = 0; j < count; j++)
    if (there(s, g, j)) found |= 1u << j;
  return found;
}

// What a robot cannot but do where it is: all but to take loads.
void act(State &s, int i) {
  for (int g = 0; g < gates; g++) {
    const uint8_t *now = gate(s, g);
    while (now[0] < all[g].needs.size() && !takes(s, g) && there(s, g, i)) {
      const int before = now[0];
      meet(s, g, all[g].needs[before].together ? those_there(s, g) : 1u << i);
      if (now[0] == before) break;
    }
  }
}

// The states that follow as a robot takes loads where it is, alone or with others, or leaves them.
void choose(State s, int i, std::vector<State> &found) {
  act(s, i);
  for (State &other : found)
    if (!memcmp(other.at, s.at, used)) return;
  found.push_back(s);
  for (int g = 0; g < gates; g++) {
    const uint8_t *now = gate(s, g);
    if (now[0] == all[g].needs.size() || !takes(s, g) || !there(s, g, i)) continue;
    const Need &need = all[g].needs[now[0]];
    const unsigned others = need.together ? those_there(s, g) & ~(1u << i) : 0;
    for (unsigned with = others;; with = (with - 1) & others) {
      State t = s;
      meet(t, g, with | 1u << i);
      if (memcmp(t.at, s.at, used)) choose(t, i, found);
      if (!with) break;
    }
  }
}

int number() {
  int found;
  if (scanf("%d", &found) != 1) exit(0);
  return found;
}

void read() {
  rows = number(), cols = number();
  wall.assign(rows * cols, 0);
  for (char &w : wall) w = number();
  count = number(), gates = number(), begin = number(), most = number();
  for (int i = 0; i < count; i++) {
    Robot &r = robots[i];
    r.heading = number(), r.ticks = number(), r.region = number(), r.face = number();
    r.to = number(), r.facing = number(), r.left = number();
    r.skills = number();
  }
  for (int g = 0; g < gates; g++) {
    Gate &one = all[g];
    one.region = number(), one.stage = number();
    one.done = number(), one.group = number();
    one.needs.assign(number(), {});
    one.closed.clear();
    for (Need &need : one.needs) {
      one.closed.push_back(number());
      need.skills = number(), need.robots = number();
      need.together = number(), need.same = number();
      need.where.assign(rows * cols, 0);
      for (int k = number(); k > 0; k--) need.where[number()] = 1;
    }
  }
  walker = number();
  targets.assign(number(), std::vector<char>(rows * cols, 0));
  for (auto &target : targets)
    for (int k = number(); k > 0; k--) target[number()] = 1;
  used = 5 * count + 3 * gates + 1;
}

bool may_enter(State &s, int i, int region) {
  if (wall[region]) return false;
  for (int g = 0; g < gates; g++) {
    unsigned stage = gate(s, g)[0];
    if (all[g].region == region && stage < all[g].needs.size() && (all[g].closed[stage] >> i & 1))
      return false;
  }
  return true;
}

// The states after the turn of robot i, into next.
void turn(State s, int i, int now, Seen &seen, std::vector<State> &next) {
  auto put_one = [&](State t) {
    const uint8_t *at = robot(t, i);
    if (i == walker && *met(t) < targets.size() && !at[4] && targets[*met(t)][at[0]]) {
      ++*met(t);
      if (*met(t) == targets.size() && last_target < 0) last_target = now;
    }
    for (int g = 0; g < gates; g++) {
      bool over = gate(t, g)[0] == all[g].needs.size();
      if (over && first[g] < 0) first[g] = now;
    }
    if (seen.add(t)) next.push_back(t);
  };
  auto put = [&](const State &t) {
    std::vector<State> choices;
    choose(t, i, choices);
    for (const State &choice : choices) put_one(choice);
  };
  uint8_t *const me = robot(s, i);
  if (me[4]) {
    if (--me[4] == 0) me[0] = me[2], me[1] = me[3], me[2] = me[3] = 0;
    put(s);
    return;
  }
  put(s);
  for (int side = 0; side < 4; side++) {
    if (robots[i].heading && side == (me[1] + 2) % 4) continue;
    int row = me[0] / cols + (side == 2) - (side == 0);
    int col = me[0] % cols + (side == 1) - (side == 3);
    if (row < 0 || col < 0 || row >= rows || col >= cols) continue;
    int region = row * cols + col, face = robots[i].heading ? side : 0;
    if (!may_enter(s, i, region)) continue;
    State t = s;
    uint8_t *mine = robot(t, i);
    if (robots[i].ticks == 1)
      mine[0] = region, mine[1] = face;
    else
      mine[2] = region, mine[3] = face, mine[4] = robots[i].ticks - 1;
    put(t);
  }
}

void answer() {
  State start;
  memset(&start, 0, sizeof start);
  for (int i = 0; i < count; i++) {
    const Robot &r = robots[i];
    const int as[] = {r.region, r.face, r.left ? r.to : 0, r.left ? r.facing : 0, r.left};
    for (int k = 0; k < 5; k++) robot(start, i)[k] = as[k];
  }
  first.assign(gates, -1);
  last_target = -1;
  for (int g = 0; g < gates; g++) {
    gate(start, g)[0] = all[g].stage, gate(start, g)[1] = all[g].done;
    gate(start, g)[2] = all[g].group;
  }
  std::vector<Seen> seen(count);
  std::vector<State> states{start}, next;
  long total = 0;
  // A state that was reached before, after a turn of the same robot, is no news: what follows from
  // it came earlier then.
  for (int now = begin; !states.empty() && total < most; now++) {
    next.clear();
    for (const State &s : states) turn(s, now % count, now, seen[now % count], next);
    total += next.size();
    states.swap(next);
    bool over = targets.empty() || last_target >= 0;
    for (int g = 0; g < gates; g++) over &= first[g] >= 0;
    if (over) break;
  }
  printf("%ld", total < most ? total : -1);
  for (int turn_ : first) printf(" %d", turn_);
  printf(" %d\n", last_target);
  fflush(stdout);
}

}  // namespace

int main() {
  while (true) {
    read();
    answer();
  }
}
