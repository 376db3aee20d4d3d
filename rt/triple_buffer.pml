/* rt/triple_buffer.h as a model for Spin, one writer and one reader, an atomic access a step.
 *
 * Checked over every interleaving of VALUES publications with any number of looks:
 *   - what the reader holds is whole, and stays as it is while it is held (assertions);
 *   - it is never older than what was held before, and newer where fresh() said so (assertions);
 *   - the last value published is held in the end, if both threads go on running (ltl newest).
 * Neither side has a statement that can block, nor a loop but the copy of a value: the number of an operation's
 * steps is fixed.
 *
 * Spin interleaves steps in one order that both threads agree on. That an exchange needs acquire and release
 * is beyond this model: the fuzz of tests/rt under ThreadSanitizer covers that, and the twins
 * of memory_order_test.cpp, which lack one order each.
 *
 * Three twins are wrong on purpose, and tests/rt/check_model demands that each is caught:
 *   -DSPLIT_EXCHANGE  an exchange is a load and a store: a slot gets two owners;
 *   -DSWAPS_ALWAYS    the reader swaps without asking whether there is something new: it goes back in time;
 *   -DKEEPS_UNREAD    the writer leaves a value that was not read in its place: the newest gets lost.
 */

#ifndef VALUES
#define VALUES 6 /* twice round the three slots */
#endif
#define WORDS 2 /* of a value: the least that can be torn */
#define INDEX 3
#define FRESH 4

typedef Slot { byte word[WORDS] }

Slot slots[3];
byte middle = 1;
byte held; /* the number of the value that the reader holds; 0: none was published */

ltl newest { <>[] (held == VALUES) }

inline exchange(given, taken) {
#ifdef SPLIT_EXCHANGE
  taken = middle & INDEX;
  middle = given
#else
  d_step { taken = middle & INDEX; middle = given }
#endif
}

active proctype writer() {
  byte back = 0, given, number, w;
  for (number : 1 .. VALUES) {
    for (w : 0 .. WORDS - 1) { /* the user fills back() */
      slots[back].word[w] = number
    }
    given = back | FRESH; /* publish() */
#ifdef KEEPS_UNREAD
    if
    :: (middle & FRESH) -> skip
    :: else -> exchange(given, back)
    fi
#else
    exchange(given, back)
#endif
  }
}

active proctype reader() {
  byte front = 2, given, number, w;
  bool fresh;
  do
  :: fresh = (middle & FRESH) != 0; /* fresh() */
     given = front; /* latest() */
     if
#ifdef SWAPS_ALWAYS
     :: exchange(given, front)
#else
     :: (middle & FRESH) -> exchange(given, front)
     :: else -> skip
#endif
     fi;
     number = slots[front].word[0]; /* the user reads the value, twice */
     assert(number >= held);
     assert(!fresh || number > held);
     held = number;
     for (w : 0 .. WORDS - 1) {
       assert(slots[front].word[w] == number)
     }
     for (w : 0 .. WORDS - 1) {
       assert(slots[front].word[w] == number)
     }
  od
}
