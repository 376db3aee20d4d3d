/* rt/spsc_ring.h as a model for Spin, one producer and one consumer, an atomic access a step.
 *
 * Checked over every interleaving of VALUES calls of push() with calls of pop() until all is over:
 *   - every value arrives once, whole and in order, or was refused (assertions);
 *   - push() refuses nothing where there was room when it was called, and pop() finds what was there when it
 *     was called (assertions);
 *   - what was refused is counted: received + dropped = VALUES in the end (assertion);
 *   - the end is reached, if both threads go on running (ltl comes_to_an_end).
 * Neither side has a statement that can block, nor a loop but the copy of a value: the number of an operation's
 * steps is fixed.
 *
 * Spin interleaves steps in one order that both threads agree on. That the loads and stores need acquire and
 * release is beyond this model: the fuzz of tests/rt under ThreadSanitizer covers that, and the twins
 * of memory_order_test.cpp, which lack one order each.
 *
 * Four twins are wrong on purpose, and tests/rt/check_model demands that each is caught:
 *   -DANNOUNCES_FIRST  a slot counts as full before the value is in it;
 *   -DFREES_FIRST      a slot counts as free before the value is out of it;
 *   -DLOOKS_ONCE       the producer trusts the head that it saw last, and never looks again;
 *   -DOVERWRITES       the producer does not ask whether the ring is full.
 */

#ifndef VALUES
#define VALUES 7 /* more than three times round the ring */
#endif
#define CAPACITY 2
#define MASK 1
#define WORDS 2 /* of a value: the least that can be torn */

typedef Slot { byte word[WORDS] }

Slot slots[CAPACITY];
byte tail, head, dropped; /* 8 bits stand for 64: neither wraps */
bool over;                /* the producer has ended */

/* What the properties are about, and the code does not have. */
bool refused[VALUES + 1]; /* by number */
bool had_room, had_value; /* when push(), pop() was called */
bool all_over;

ltl comes_to_an_end { <> all_over }

active proctype producer() {
  byte own_tail, head_seen, count, number, w;
  bool no_room;
  for (number : 1 .. VALUES) {
    d_step { own_tail = tail; had_room = tail - head < CAPACITY }; /* push(number) */
#ifdef OVERWRITES
    no_room = false;
#else
    no_room = own_tail - head_seen == CAPACITY;
#endif
    if
    :: no_room ->
#ifndef LOOKS_ONCE
       head_seen = head;
#endif
       no_room = own_tail - head_seen == CAPACITY
    :: else -> skip
    fi;
    if
    :: no_room ->
       assert(!had_room);
       count = dropped;
       dropped = count + 1;
       refused[number] = true
    :: else ->
#ifdef ANNOUNCES_FIRST
       tail = own_tail + 1;
#endif
       for (w : 0 .. WORDS - 1) {
         slots[own_tail & MASK].word[w] = number
       }
#ifndef ANNOUNCES_FIRST
       tail = own_tail + 1
#endif
    fi
  }
  over = true
}

active proctype consumer() {
  byte own_head, tail_seen, received, last, w;
  byte value[WORDS];
  bool last_look, nothing;
  do
  :: last_look = over;
     d_step { own_head = head; had_value = tail != head }; /* pop(value) */
     nothing = own_head == tail_seen;
     if
     :: nothing ->
        tail_seen = tail;
        nothing = own_head == tail_seen
     :: else -> skip
     fi;
     if
     :: nothing ->
        assert(!had_value);
        if
        :: last_look -> break
        :: else -> skip
        fi
     :: else ->
#ifdef FREES_FIRST
        head = own_head + 1;
#endif
        for (w : 0 .. WORDS - 1) {
          value[w] = slots[own_head & MASK].word[w]
        }
#ifndef FREES_FIRST
        head = own_head + 1;
#endif
        received++;
        for (w : 1 .. WORDS - 1) {
          assert(value[w] == value[0])
        }
        assert(value[0] > last);
        for (w : last + 1 .. value[0] - 1) {
          assert(refused[w])
        }
        last = value[0]
     fi
  od;
  assert(received + dropped == VALUES);
  all_over = true
}
