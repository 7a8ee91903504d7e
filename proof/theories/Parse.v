(** From the bytes of a structured slugs file to its meaning. A definition, to be read: the theorems
    are about its result. Unknown text is refused, never guessed. *)
From Coq Require Import Ascii String List NArith Arith Bool.
From Proved Require Import Gr1.
Import ListNotations.
Local Open Scope N_scope.

Definition text := list N.  (** bytes *)

Fixpoint codes (s : string) : text :=
  match s with
  | EmptyString => []
  | String c s => N_of_ascii c :: codes s
  end.

Fixpoint same (a b : text) : bool :=
  match a, b with
  | [], [] => true
  | x :: a, y :: b => if x =? y then same a b else false
  | _, _ => false
  end.

Fixpoint starts (a b : text) : option text :=  (** what follows [a] in [b] *)
  match a, b with
  | [], _ => Some b
  | x :: a, y :: b => if x =? y then starts a b else None
  | _, [] => None
  end.

Fixpoint lookup {A} (l : list (text * A)) (w : text) : option A :=
  match l with
  | [] => None
  | (v, a) :: l => if same v w then Some a else lookup l w
  end.

Definition is_space (c : N) : bool := (c =? 32) || (c =? 9) || (c =? 13).
Definition is_digit (c : N) : bool := (48 <=? c) && (c <=? 57).
Definition is_letter (c : N) : bool :=
  ((65 <=? c) && (c <=? 90)) || ((97 <=? c) && (c <=? 122)) || (c =? 95).

Fixpoint span (p : N -> bool) (s : text) : text * text :=
  match s with
  | c :: s' => if p c then let (a, b) := span p s' in (c :: a, b) else ([], s)
  | [] => ([], [])
  end.

Definition number (s : text) : N := fold_left (fun n c => 10 * n + (c - 48)) s 0.

Fixpoint lines (s : text) : list text :=
  match s with
  | [] => [[]]
  | c :: s => match lines s with
              | l :: ls => if c =? 10 then [] :: l :: ls else (c :: l) :: ls
              | [] => [[c]]
              end
  end.

(** Whether a text begins with a character that other programs may take for the end of a line: a
    control character but a tab or a line feed, U+2028, U+2029. A carriage return may end a line. *)
Definition foreign (s : text) : bool :=
  match s with
  | [] => false
  | c :: s =>
      let d := hd 10 s in
      if c =? 13 then negb (d =? 10)
      else if c =? 194 then (128 <=? d) && (d <? 160)
      else if c =? 226 then (d =? 128) && ((hd 0 (tl s) =? 168) || (hd 0 (tl s) =? 169))
      else ((c <? 32) && negb (c =? 9) && negb (c =? 10)) || (c =? 127)
  end.

Fixpoint plain (s : text) : bool :=
  if foreign s then false else match s with [] => true | _ :: s => plain s end.

Definition strip (s : text) : text :=
  rev' (snd (span is_space (rev' (snd (span is_space s))))).

(** * Words *)

Inductive op := OIff | OImp | OXor | OOr | OAnd | OCmp (c : cmp) | OAdd.
Inductive token :=
  Num (n : N) | Word (w : text) (primed : bool) | Op (o : op) | Neg | Open | Close | Colon | Dots.

(** The longest match comes first. *)
Definition symbols : list (text * token) := Eval compute in
  map (fun p => (codes (fst p), snd p))
  [("<-->"%string, Op OIff); ("-->"%string, Op OImp); ("/\"%string, Op OAnd); ("\/"%string, Op OOr);
   ("~"%string, Neg); ("<->"%string, Op OIff); ("->"%string, Op OImp); ("&&"%string, Op OAnd); ("||"%string, Op OOr);
   ("!="%string, Op (OCmp CNe)); ("<="%string, Op (OCmp CLe)); (">="%string, Op (OCmp CGe));
   ("!"%string, Neg); ("&"%string, Op OAnd); ("|"%string, Op OOr); ("^"%string, Op OXor);
   ("="%string, Op (OCmp CEq)); ("<"%string, Op (OCmp CLt)); (">"%string, Op (OCmp CGt));
   ("+"%string, Op OAdd); ("("%string, Open); (")"%string, Close);
   ("..."%string, Dots); (":"%string, Colon)].

Fixpoint symbol (l : list (text * token)) (s : text) : option (token * text) :=
  match l with
  | [] => None
  | (a, t) :: l => match starts a s with Some rest => Some (t, rest) | None => symbol l s end
  end.

Fixpoint lex (fuel : nat) (s : text) : option (list token) :=
  match fuel with
  | O => None
  | S fuel =>
      let go := fun t rest => match lex fuel rest with Some ts => Some (t :: ts) | None => None end in
      match s with
      | [] => Some []
      | c :: s' =>
          if is_space c then lex fuel s'
          else if is_digit c then let (d, rest) := span is_digit s in go (Num (number d)) rest
          else if is_letter c then
            let (w, rest) := span (fun c => is_letter c || is_digit c) s in
            match rest with
            | 39 :: 39 :: _ => None
            | 39 :: rest => go (Word w true) rest
            | _ => go (Word w false) rest
            end
          else match symbol symbols s with Some (t, rest) => go t rest | None => None end
      end
  end.

(** * Formulas *)

Fixpoint find_name (l : list (text * bool)) (x : var) (w : text) : option (var * bool) :=
  match l with
  | [] => None
  | (v, b) :: l => if same v w then Some (x, b) else find_name l (S x) w
  end.

Inductive expr := Formula (f : form) | Number (t : term).

Definition constants : list (text * expr) := Eval compute in
  map (fun p => (codes (fst p), snd p))
  [("TRUE"%string, Formula T); ("FALSE"%string, Formula F)].

Definition reserved : list text := Eval compute in
  codes "next"%string :: codes "X"%string :: map fst constants.

Definition variable (ns : list (text * bool)) (w : text) (primed : bool) : option expr :=
  match find_name ns 0%nat w with
  | None => None
  | Some (x, truth) =>
      let r := if primed then Next x else Now x in
      Some (if truth then Formula (Truth r) else Number (Ref r))
  end.

(** [inside]: within [next(...)], where each variable is primed and may not be so already. *)
Definition word (ns : list (text * bool)) (inside : bool) (w : text) (primed : bool) : option expr :=
  match lookup constants w with
  | Some e => if primed then None else Some e
  | None => if inside && primed then None else variable ns w (inside || primed)
  end.

Definition next_ : text := Eval compute in codes "next".
Definition x_ : text := Eval compute in codes "X".

Definition is_next (w : text) (primed : bool) (ts : list token) : bool :=
  match ts with
  | Open :: _ => negb primed && (same w next_ || same w x_)
  | _ => false
  end.

(** How tightly an operator binds. *)
Definition strength (o : op) : nat :=
  (match o with
   | OIff => 1 | OImp => 2 | OXor => 3 | OOr => 4 | OAnd => 5 | OCmp _ => 7 | OAdd => 8
   end)%nat.

Definition join (o : op) (a b : expr) : option expr :=
  match o, a, b with
  | OIff, Formula f, Formula g => Some (Formula (Iff f g))
  | OImp, Formula f, Formula g => Some (Formula (Imp f g))
  | OXor, Formula f, Formula g => Some (Formula (Xor f g))
  | OOr, Formula f, Formula g => Some (Formula (Or f g))
  | OAnd, Formula f, Formula g => Some (Formula (And f g))
  | OCmp c, Number s, Number t => Some (Formula (Cmp c s t))
  | OAdd, Number s, Number t => Some (Number (Add s t))
  | _, _, _ => None
  end.

Section Formulas.
Variable ns : list (text * bool).

Fixpoint read (fuel : nat) (inside : bool) (least : nat) (ts : list token)
  : option (expr * list token) :=
  match fuel with
  | O => None
  | S fuel =>
      match ts with
      | Num n :: ts => more fuel inside least (Number (Const n)) ts
      | Word w p :: ts =>
          if is_next w p ts then
            if inside then None
            else match read fuel true 9%nat ts with
                 | Some (e, ts) => more fuel inside least e ts
                 | None => None
                 end
          else match word ns inside w p with
               | Some e => more fuel inside least e ts
               | None => None
               end
      | Neg :: ts => match read fuel inside 6%nat ts with
                     | Some (Formula f, ts) => more fuel inside least (Formula (Not f)) ts
                     | _ => None
                     end
      | Open :: ts => match read fuel inside 0%nat ts with
                      | Some (e, Close :: ts) => more fuel inside least e ts
                      | _ => None
                      end
      | _ => None
      end
  end
with more (fuel : nat) (inside : bool) (least : nat) (a : expr) (ts : list token)
  : option (expr * list token) :=
  match fuel with
  | O => None
  | S fuel =>
      match ts with
      | Op o :: rest =>
          if Nat.leb least (strength o) then
            match read fuel inside (S (strength o)) rest with
            | Some (b, rest) =>
                match join o a b with Some e => more fuel inside least e rest | None => None end
            | None => None
            end
          else Some (a, ts)
      | _ => Some (a, ts)
      end
  end.

Definition formula (s : text) : option form :=
  match lex (S (length s)) s with
  | None => None
  | Some ts => match read (2 * S (length ts))%nat false 0%nat ts with
               | Some (Formula f, []) => Some f
               | _ => None
               end
  end.

Fixpoint formulas (ls : list text) : option (list form) :=
  match ls with
  | [] => Some []
  | l :: ls => match formula l, formulas ls with
               | Some f, Some fs => Some (f :: fs)
               | _, _ => None
               end
  end.
End Formulas.

(** * Files *)

(** A name, or [name: least...most]: the name, whether it is a truth, and its values. *)
Definition declaration (s : text) : option (text * bool * (N * N)) :=
  match lex (S (length s)) s with
  | Some (Word w false :: rest) =>
      if existsb (same w) reserved then None
      else match rest with
      | [] => Some (w, true, (0, 1))
      | [Colon; Num lo; Dots; Num hi] => if lo <=? hi then Some (w, false, (lo, hi)) else None
      | _ => None
      end
  | _ => None
  end.

Fixpoint declarations (ls : list text) : option (list (text * bool * (N * N))) :=
  match ls with
  | [] => Some []
  | l :: ls => match declaration l, declarations ls with
               | Some d, Some ds =>
                   if existsb (fun e => same (fst (fst d)) (fst (fst e))) ds then None
                   else Some (d :: ds)
               | _, _ => None
               end
  end.

Inductive section :=
  Input | Output | EnvInit | SysInit | EnvTrans | SysTrans | EnvLive | SysLive.
Scheme Equality for section.  (** the function [section_beq] *)

Definition titles : list (text * section) := Eval compute in
  map (fun p => (codes (fst p), snd p))
  [("[INPUT]"%string, Input); ("[OUTPUT]"%string, Output);
   ("[ENV_INIT]"%string, EnvInit); ("[SYS_INIT]"%string, SysInit);
   ("[ENV_TRANS]"%string, EnvTrans); ("[SYS_TRANS]"%string, SysTrans);
   ("[ENV_LIVENESS]"%string, EnvLive); ("[SYS_LIVENESS]"%string, SysLive)].

(** Each line with content, with its section. *)
Fixpoint sorted (at_ : option section) (ls : list text) : option (list (section * text)) :=
  match ls with
  | [] => Some []
  | l :: ls =>
      match l with
      | [] => sorted at_ ls
      | 35 :: _ => sorted at_ ls
      | 91 :: _ => match lookup titles l with Some x => sorted (Some x) ls | None => None end
      | _ => match at_, sorted at_ ls with
             | Some x, Some rest => Some ((x, l) :: rest)
             | _, _ => None
             end
      end
  end.

Definition of (x : section) (ls : list (section * text)) : list text :=
  map snd (filter (fun l => section_beq x (fst l)) ls).

Definition parse_lines (ls : list (section * text)) : option (spec * list (text * bool)) :=
  match declarations (of Input ls ++ of Output ls) with
  | None => None
  | Some ds =>
      let ns := map fst ds in
      let part := fun x => formulas ns (of x ls) in
      match part EnvInit, part SysInit, part EnvTrans, part SysTrans, part EnvLive, part SysLive with
      | Some ei, Some si, Some et, Some st, Some el, Some sl =>
          Some ({| ranges := map snd ds; inputs := length (of Input ls);
                   env_init := ei; sys_init := si; env_trans := et; sys_trans := st;
                   env_live := el; sys_live := sl |}, ns)
      | _, _, _, _, _, _ => None
      end
  end.

(** The meaning of a file after a byte order mark, and its variables: each name, and whether it is a
    truth. *)
Definition parse (s : text) : option (spec * list (text * bool)) :=
  let s := match starts [239; 187; 191] s with Some s => s | None => s end in
  if plain s then
    match sorted None (map strip (lines s)) with
    | Some ls => parse_lines ls
    | None => None
    end
  else None.
