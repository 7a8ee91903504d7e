(** A printer for specifications, and the round trip: [parse] reads each printed specification back
    unchanged. So it can produce every specification, and brackets, names and numbers have their
    intended meaning. *)
From Coq Require Import Ascii String List NArith PArith Arith Bool Lia.
From Proved Require Import Gr1 Parse.
Import ListNotations.
Local Open Scope N_scope.

(** A declared variable: its name, whether it is a truth, its values. *)
Definition declared := (text * bool * (N * N))%type.

(** * Printing *)

Fixpoint digits (fuel : nat) (n : N) (after : text) : text :=
  match fuel with
  | O => after
  | S fuel => let after := 48 + n mod 10 :: after in
              if n / 10 =? 0 then after else digits fuel (n / 10) after
  end.
Definition decimal (n : N) : text := digits (S (N.to_nat (N.log2 n))) n [].

Definition sign (o : op) : text := codes match o with
  | OIff => "<->" | OImp => "->" | OXor => "^" | OOr => "|" | OAnd => "&" | OAdd => "+"
  | OCmp CEq => "=" | OCmp CNe => "!=" | OCmp CLt => "<" | OCmp CLe => "<=" | OCmp CGt => ">"
  | OCmp CGe => ">=" end%string.

Definition spelled (t : token) : text :=
  match t with
  | Num n => decimal n
  | Word w primed => if primed then w ++ [39] else w
  | Op o => sign o
  | Neg => [33] | Open => [40] | Close => [41] | Colon => [58] | Dots => [46; 46; 46]
  end.

Fixpoint spaced (ts : list token) : text :=
  match ts with
  | [] => []
  | [t] => spelled t
  | t :: ts => spelled t ++ 32 :: spaced ts
  end.

Section Formulas.
Variable ns : list (text * bool).

Definition name_of (x : var) : text := fst (nth x ns ([], false)).
Definition ref_token (r : ref) : token :=
  match r with Now x => Word (name_of x) false | Next x => Word (name_of x) true end.
Definition true_ : text := Eval compute in codes "TRUE".
Definition false_ : text := Eval compute in codes "FALSE".

Fixpoint term_tokens (t : term) : list token :=
  match t with
  | Const n => [Num n]
  | Ref r => [ref_token r]
  | Add a b => Open :: term_tokens a ++ Op OAdd :: term_tokens b ++ [Close]
  end.

Fixpoint tokens (f : form) : list token :=
  let two o f g := Open :: tokens f ++ Op o :: tokens g ++ [Close] in
  match f with
  | T => [Word true_ false]
  | F => [Word false_ false]
  | Truth r => [ref_token r]
  | Cmp c a b => Open :: term_tokens a ++ Op (OCmp c) :: term_tokens b ++ [Close]
  | Not f => Open :: Neg :: tokens f ++ [Close]
  | And f g => two OAnd f g | Or f g => two OOr f g | Imp f g => two OImp f g
  | Iff f g => two OIff f g | Xor f g => two OXor f g
  end.

(** A formula uses declared variables according to their kinds. *)
Definition var_of (r : ref) : var := match r with Now x => x | Next x => x end.
Definition is_declared (truth : bool) (r : ref) : Prop :=
  exists w, nth_error ns (var_of r) = Some (w, truth).
Fixpoint term_fits (t : term) : Prop :=
  match t with
  | Const _ => True
  | Ref r => is_declared false r
  | Add a b => term_fits a /\ term_fits b
  end.
Fixpoint fits (f : form) : Prop :=
  match f with
  | T | F => True
  | Truth r => is_declared true r
  | Cmp _ a b => term_fits a /\ term_fits b
  | Not f => fits f
  | And f g | Or f g | Imp f g | Iff f g | Xor f g => fits f /\ fits g
  end.
End Formulas.

Definition declared_tokens (d : declared) : list token :=
  let '(w, truth, (lo, hi)) := d in
  Word w false :: if truth then [] else [Colon; Num lo; Dots; Num hi].
Definition declared_text (d : declared) : text := spaced (declared_tokens d).

Fixpoint unlines (ls : list text) : text :=
  match ls with [] => [] | [l] => l | l :: ls => l ++ 10 :: unlines ls end.

Definition parts (sp : spec) (ds : list declared) : list (section * text * list text) :=
  let ins := firstn (inputs sp) ds in
  let outs := skipn (inputs sp) ds in
  let fs := map (fun f => spaced (tokens (map fst ds) f)) in
  [(Input, codes "[INPUT]", map declared_text ins); (Output, codes "[OUTPUT]", map declared_text outs);
   (EnvInit, codes "[ENV_INIT]", fs (env_init sp)); (SysInit, codes "[SYS_INIT]", fs (sys_init sp));
   (EnvTrans, codes "[ENV_TRANS]", fs (env_trans sp)); (SysTrans, codes "[SYS_TRANS]", fs (sys_trans sp));
   (EnvLive, codes "[ENV_LIVENESS]", fs (env_live sp)); (SysLive, codes "[SYS_LIVENESS]", fs (sys_live sp))].

Definition print (sp : spec) (ds : list declared) : text :=
  unlines (flat_map (fun p => snd (fst p) :: snd p) (parts sp ds)).

(** Printable specifications: different names, none of them reserved; Booleans have the values 0 and
    1, and no range is empty; formulas use declared variables. *)
Definition good_name (w : text) : Prop :=
  match w with [] => False | c :: _ => is_letter c = true end /\
  forallb (fun c => is_letter c || is_digit c) w = true /\ existsb (same w) reserved = false.

Definition good_declared (d : declared) : Prop :=
  good_name (fst (fst d)) /\ (snd (fst d) = true -> snd d = (0, 1)) /\ fst (snd d) <= snd (snd d).

Definition good (sp : spec) (ds : list declared) : Prop :=
  ranges sp = map snd ds /\ (inputs sp <= length ds)%nat /\
  NoDup (map (fun d => fst (fst d)) ds) /\
  (forall d, In d ds -> good_declared d) /\
  (forall f, In f (env_init sp ++ sys_init sp ++ env_trans sp ++ sys_trans sp ++ env_live sp ++ sys_live sp) ->
     fits (map fst ds) f).

(** * Numbers *)

Definition step (n c : N) : N := 10 * n + (c - 48).

Lemma digits_ok fuel : forall n after, n < 2 ^ N.of_nat fuel ->
  fold_left step (digits fuel n after) 0 = fold_left step after n.
Proof.
  induction fuel as [| fuel IH]; intros n after L.
  - cbn in *. replace n with 0 by lia. reflexivity.
  - cbn [digits]. pose proof (N.div_mod n 10 ltac:(discriminate)) as E.
    pose proof (N.mod_lt n 10 ltac:(discriminate)) as M.
    assert (step (n / 10) (48 + n mod 10) = n) as St.
    { clear L IH. unfold step. revert E M. generalize (n / 10) (n mod 10). intros; lia. }
    destruct (N.eqb_spec (n / 10) 0) as [Z | Z].
    + rewrite Z in St. cbn [fold_left]. rewrite St. reflexivity.
    + rewrite IH.
      * cbn [fold_left]. rewrite St. reflexivity.
      * rewrite Nnat.Nat2N.inj_succ, N.pow_succ_r' in L. clear - L E.
        revert L E. generalize (2 ^ N.of_nat fuel) (n / 10) (n mod 10). intros; lia.
Qed.

Lemma decimal_number n : number (decimal n) = n.
Proof.
  unfold number, decimal. change (fun n c => 10 * n + (c - 48)) with step.
  rewrite digits_ok; [reflexivity |]. rewrite Nnat.Nat2N.inj_succ, Nnat.N2Nat.id.
  destruct n as [| p]; [reflexivity |]. apply N.log2_spec. reflexivity.
Qed.

Lemma digits_are fuel : forall n after, forallb is_digit after = true ->
  forallb is_digit (digits fuel n after) = true.
Proof.
  induction fuel as [| fuel IH]; intros n after A; [auto |]. cbn [digits].
  assert (forallb is_digit (48 + n mod 10 :: after) = true) as B.
  { cbn [forallb]. rewrite A, andb_true_r. pose proof (N.mod_lt n 10 ltac:(discriminate)) as M.
    revert M. generalize (n mod 10). intros m M. unfold is_digit.
    apply andb_true_iff. split; apply N.leb_le; lia. }
  destruct (n / 10 =? 0); auto.
Qed.

Lemma digits_some fuel : forall n c after, exists d ds, digits fuel n (c :: after) = d :: ds.
Proof.
  induction fuel as [| fuel IH]; intros; cbn [digits]; [eauto |].
  destruct (n / 10 =? 0); eauto.
Qed.

Lemma decimal_digits n : forallb is_digit (decimal n) = true.
Proof. apply digits_are. reflexivity. Qed.

Lemma decimal_some n : exists d ds, decimal n = d :: ds.
Proof.
  unfold decimal. cbn [digits]. destruct (n / 10 =? 0); [eauto | apply digits_some].
Qed.

(** * Spans and characters *)

Lemma span_app p a b : forallb p a = true -> match b with [] => True | c :: _ => p c = false end ->
  span p (a ++ b) = (a, b).
Proof.
  intros A B. induction a as [| c a IH]; cbn in *.
  - destruct b as [| c b]; [reflexivity |]. cbn. rewrite B. reflexivity.
  - apply andb_true_iff in A as (C & A). rewrite C, IH; auto.
Qed.

Lemma same_ok a : forall b, same a b = true <-> a = b.
Proof.
  induction a as [| x a IH]; intros [| y b]; cbn; split; intros E; try congruence; auto.
  - destruct (N.eqb_spec x y); [subst | discriminate]. apply IH in E. congruence.
  - injection E as <- <-. rewrite N.eqb_refl. apply IH; auto.
Qed.

Lemma same_refl a : same a a = true.
Proof. apply same_ok; auto. Qed.

(** * Words *)

Definition good_token (t : token) : Prop :=
  match t with Word w _ => good_name w \/ w = true_ \/ w = false_ | _ => True end.

Definition ends (rest : text) : Prop := rest = [] \/ exists r, rest = 32 :: r.

Lemma letter_no_space c : is_letter c = true -> is_space c = false /\ is_digit c = false.
Proof.
  unfold is_letter, is_space, is_digit. intros L.
  rewrite !orb_true_iff, !andb_true_iff, !N.leb_le, N.eqb_eq in L.
  split; [rewrite !orb_false_iff, !N.eqb_neq; lia | rewrite andb_false_iff, !N.leb_gt; lia].
Qed.

Lemma digit_no_space c : is_digit c = true -> is_space c = false.
Proof.
  unfold is_space, is_digit. intros L. rewrite !andb_true_iff, !N.leb_le in L.
  rewrite !orb_false_iff, !N.eqb_neq; lia.
Qed.

Lemma word_name w primed : good_token (Word w primed) ->
  match w with [] => False | c :: _ => is_letter c = true end /\
  forallb (fun c => is_letter c || is_digit c) w = true.
Proof. intros [(A & B & _) | [-> | ->]]; [auto | split; reflexivity | split; reflexivity]. Qed.

Lemma lex_token t rest fuel : good_token t -> ends rest ->
  lex (S fuel) (spelled t ++ rest) =
  match lex fuel rest with Some ts => Some (t :: ts) | None => None end.
Proof.
  intros G E. destruct t as [n | w primed | o | | | | |]; cbn [spelled].
  - destruct (decimal_some n) as (d & ds & D). pose proof (decimal_digits n) as A.
    assert (is_digit d = true) as I by (rewrite D in A; cbn in A; apply andb_true_iff in A; tauto).
    assert (span is_digit (decimal n ++ rest) = (decimal n, rest)) as S.
    { apply span_app; auto. destruct E as [-> | (r & ->)]; reflexivity || exact I || auto. }
    rewrite D in *. cbn [app lex] in *. rewrite (digit_no_space d I), I, S, <- D, decimal_number.
    reflexivity.
  - apply word_name in G as (H & A). destruct w as [| c w]; [destruct H |].
    destruct (letter_no_space c H) as (S & D).
    destruct primed.
    + assert (span (fun c => is_letter c || is_digit c) ((c :: w) ++ 39 :: rest) = (c :: w, 39 :: rest)) as P
        by (apply span_app; auto).
      rewrite <- app_assoc. cbn [app] in *. cbn [lex]. rewrite S, D, H, P.
      destruct E as [-> | (r & ->)]; reflexivity.
    + assert (span (fun c => is_letter c || is_digit c) ((c :: w) ++ rest) = (c :: w, rest)) as P.
      { apply span_app; auto. destruct E as [-> | (r & ->)]; reflexivity || exact Logic.I. }
      cbn [app] in *. cbn [lex]. rewrite S, D, H, P.
      destruct E as [-> | (r & ->)]; reflexivity.
  - destruct E as [-> | (r & ->)]; destruct o as [| | | | | c |]; try destruct c; reflexivity.
  - destruct E as [-> | (r & ->)]; reflexivity.
  - destruct E as [-> | (r & ->)]; reflexivity.
  - destruct E as [-> | (r & ->)]; reflexivity.
  - destruct E as [-> | (r & ->)]; reflexivity.
  - destruct E as [-> | (r & ->)]; reflexivity.
Qed.

Lemma spelled_some t : good_token t -> exists c w, spelled t = c :: w.
Proof.
  destruct t as [n | w primed | o | | | | |]; intros G; cbn; eauto.
  - apply decimal_some.
  - apply word_name in G as (H & _). destruct w as [| c w]; [destruct H |].
    destruct primed; cbn; eauto.
  - destruct o as [| | | | | c |]; try destruct c; cbn; eauto.
Qed.

Lemma lex_spaced ts : forall fuel, Forall good_token ts -> (length (spaced ts) < fuel)%nat ->
  lex fuel (spaced ts) = Some ts.
Proof.
  induction ts as [| t ts IH]; intros fuel G L.
  - destruct fuel; [cbn in L; lia | reflexivity].
  - destruct fuel as [| fuel]; [lia |]. inversion G as [| ? ? Gt Gs]; subst.
    destruct (spelled_some t Gt) as (c & w & Sp).
    destruct ts as [| u ts].
    + change (spaced [t]) with (spelled t) in *.
      rewrite <- (app_nil_r (spelled t)), lex_token; [| auto | left; auto].
      rewrite Sp in L. cbn in L. destruct fuel; [lia | reflexivity].
    + change (spaced (t :: u :: ts)) with (spelled t ++ 32 :: spaced (u :: ts)) in *.
      rewrite lex_token; [| auto | right; eauto]. rewrite app_length, Sp in L. cbn [length] in L.
      destruct fuel as [| fuel]; [lia |].
      change (lex (S fuel) (32 :: spaced (u :: ts))) with (lex fuel (spaced (u :: ts))).
      rewrite IH; auto. lia.
Qed.

(** * Formulas *)

Section Reading.
Variable ns : list (text * bool).
Hypothesis different : NoDup (map fst ns).
Hypothesis names : forall w b, In (w, b) ns -> good_name w.

Lemma find_name_ok : forall (l : list (text * bool)) x k w b, NoDup (map fst l) ->
  nth_error l x = Some (w, b) -> find_name l k w = Some ((k + x)%nat, b).
Proof.
  induction l as [| (v, c) l IH]; intros x k w b D E; [destruct x; discriminate |].
  cbn [map fst] in D. inversion D as [| ? ? N D']; subst. cbn [find_name].
  destruct x as [| x]; cbn in E.
  - injection E as -> ->. rewrite same_refl, Nat.add_0_r. reflexivity.
  - destruct (same v w) eqn:Sw.
    + exfalso. apply same_ok in Sw as ->. apply N. change w with (fst (w, b)).
      apply in_map. eapply nth_error_In; eauto.
    + rewrite (IH x (S k) w b D' E). f_equal. f_equal. lia.
Qed.

Lemma not_reserved w : good_name w -> lookup constants w = None /\
  same w next_ = false /\ same w x_ = false.
Proof.
  intros (_ & _ & R). unfold reserved in R. cbn [existsb] in R. rewrite !orb_false_iff in R.
  destruct R as (R1 & R2 & R3 & R4 & _).
  assert (forall a, same w a = false -> same a w = false) as Sym.
  { intros a A. rewrite <- not_true_iff_false in *. rewrite !same_ok in *. auto. }
  split; [| split; [exact R1 | exact R2]].
  unfold constants. cbn [lookup]. rewrite !Sym; auto.
Qed.

Definition expr_of_ref (b : bool) (r : ref) : expr := if b then Formula (Truth r) else Number (Ref r).

Lemma read_ref b r rest fuel least : is_declared ns b r ->
  read ns (S fuel) false least (ref_token ns r :: rest) = more ns fuel false least (expr_of_ref b r) rest.
Proof.
  intros (w & E). assert (name_of ns (var_of r) = w) as N.
  { unfold name_of. rewrite (nth_error_nth _ _ _ E). reflexivity. }
  assert (good_name w) as G by (eapply names, nth_error_In; eauto).
  destruct (not_reserved w G) as (C & A & B).
  assert (variable ns w match r with Now _ => false | Next _ => true end = Some (expr_of_ref b r)) as V.
  { unfold variable. rewrite (find_name_ok ns (var_of r) 0%nat w b different E). cbn.
    destruct r; reflexivity. }
  assert (ref_token ns r = Word w match r with Now _ => false | Next _ => true end) as ->.
  { destruct r; cbn in *; rewrite N; reflexivity. }
  set (p := match r with Now _ => false | Next _ => true end) in *.
  cbn [read]. assert (is_next w p rest = false) as ->.
  { unfold is_next. destruct rest as [| []]; auto. rewrite A, B. apply andb_false_r. }
  unfold word. rewrite C. cbn [andb orb]. rewrite V. reflexivity.
Qed.

Fixpoint term_need (t : term) : nat :=
  match t with Add a b => term_need a + term_need b + 4 | _ => 0 end%nat.
Fixpoint need (f : form) : nat :=
  (match f with
   | T | F | Truth _ => 0
   | Cmp _ a b => term_need a + term_need b + 4
   | Not f => need f + 4
   | And f g | Or f g | Imp f g | Iff f g | Xor f g => need f + need g + 4
   end)%nat.

Lemma read_open fuel least ts : read ns (S fuel) false least (Open :: ts) =
  match read ns fuel false 0%nat ts with
  | Some (e, Close :: ts) => more ns fuel false least e ts
  | _ => None
  end.
Proof. reflexivity. Qed.

Lemma read_neg fuel least ts : read ns (S fuel) false least (Neg :: ts) =
  match read ns fuel false 6%nat ts with
  | Some (Formula f, ts) => more ns fuel false least (Formula (Not f)) ts
  | _ => None
  end.
Proof. reflexivity. Qed.

Lemma more_op fuel o a ts : more ns (S fuel) false 0%nat a (Op o :: ts) =
  match read ns fuel false (S (strength o)) ts with
  | Some (b, rest) => match join o a b with Some e => more ns fuel false 0%nat e rest | None => None end
  | None => None
  end.
Proof. reflexivity. Qed.

Lemma more_close fuel least a ts :
  more ns (S fuel) false least a (Close :: ts) = Some (a, Close :: ts).
Proof. reflexivity. Qed.

(** A bracket with two operands, each read correctly. *)
Lemma read_two o a b c ta tb rest fuel least na nb :
  (forall fuel least rest, (na <= fuel)%nat ->
     read ns (S fuel) false least (ta ++ rest) = more ns fuel false least a rest) ->
  (forall fuel least rest, (nb <= fuel)%nat ->
     read ns (S fuel) false least (tb ++ rest) = more ns fuel false least b rest) ->
  join o a b = Some c -> (na + nb + 4 <= fuel)%nat ->
  read ns (S fuel) false least (Open :: ta ++ Op o :: tb ++ Close :: rest) = more ns fuel false least c rest.
Proof.
  intros A B J L. rewrite read_open. destruct fuel as [| fuel]; [lia |]. rewrite A by lia.
  destruct fuel as [| fuel]; [lia |]. rewrite more_op.
  destruct fuel as [| fuel]; [lia |]. rewrite B by lia.
  destruct fuel as [| fuel]; [lia |]. rewrite more_close, J, more_close. reflexivity.
Qed.

Lemma app_two {A} (a : list A) x b y rest : (a ++ x :: b ++ [y]) ++ rest = a ++ x :: b ++ y :: rest.
Proof. rewrite <- app_assoc. cbn. rewrite <- app_assoc. reflexivity. Qed.

Lemma read_term t : term_fits ns t -> forall fuel least rest, (term_need t <= fuel)%nat ->
  read ns (S fuel) false least (term_tokens ns t ++ rest) = more ns fuel false least (Number t) rest.
Proof.
  induction t as [n | r | a IHa b IHb]; intros Fi fuel least rest L.
  - reflexivity.
  - apply (read_ref false); auto.
  - destruct Fi as (Fa & Fb). cbn [term_tokens app]. rewrite app_two.
    eapply read_two; eauto.
Qed.

Lemma read_form f : fits ns f -> forall fuel least rest, (need f <= fuel)%nat ->
  read ns (S fuel) false least (tokens ns f ++ rest) = more ns fuel false least (Formula f) rest.
Proof.
  induction f as [| | r | c a b | f IHf | f IHf g IHg | f IHf g IHg | f IHf g IHg
    | f IHf g IHg | f IHf g IHg]; intros Fi fuel least rest L; cbn [tokens need fits] in *;
    try (destruct Fi as (Fa & Fb); cbn [app]; rewrite app_two; eapply read_two;
         [apply IHf | apply IHg | reflexivity | exact L]; assumption).
  - cbn [app read]. unfold is_next. destruct rest as [| []]; reflexivity.
  - cbn [app read]. unfold is_next. destruct rest as [| []]; reflexivity.
  - apply (read_ref true); auto.
  - destruct Fi as (Fa & Fb). cbn [app]. rewrite app_two. eapply read_two;
      [apply read_term | apply read_term | reflexivity | exact L]; assumption.
  - cbn [app]. rewrite <- app_assoc. cbn [app]. rewrite read_open.
    destruct fuel as [| fuel]; [lia |]. rewrite read_neg.
    destruct fuel as [| fuel]; [lia |]. rewrite IHf by (auto; lia).
    destruct fuel as [| fuel]; [lia |]. rewrite !more_close. reflexivity.
Qed.

Lemma term_need_length t : (term_need t + 2 <= 2 * length (term_tokens ns t))%nat.
Proof.
  induction t as [n | r | a IHa b IHb]; cbn [term_tokens term_need length]; try lia.
  rewrite app_length. cbn [length]. rewrite app_length. cbn [length]. lia.
Qed.

Lemma need_length f : (need f + 2 <= 2 * length (tokens ns f))%nat.
Proof.
  induction f as [| | r | c a b | f IHf | f IHf g IHg | f IHf g IHg | f IHf g IHg
    | f IHf g IHg | f IHf g IHg]; cbn [tokens need length]; try lia;
    rewrite app_length; cbn [length]; rewrite ?app_length; cbn [length]; try lia.
  pose proof (term_need_length a). pose proof (term_need_length b). lia.
Qed.

Lemma ref_good b r : is_declared ns b r -> good_token (ref_token ns r).
Proof.
  intros (w & E). assert (name_of ns (var_of r) = w) as N.
  { unfold name_of. rewrite (nth_error_nth _ _ _ E). reflexivity. }
  destruct r; cbn in *; rewrite N; left; eapply names, nth_error_In; eauto.
Qed.

Lemma term_tokens_good t : term_fits ns t -> Forall good_token (term_tokens ns t).
Proof.
  induction t as [n | r | a IHa b IHb]; intros Fi; cbn [term_tokens].
  - repeat constructor.
  - constructor; [eapply ref_good; eauto | constructor].
  - destruct Fi. constructor; [exact I |]. apply Forall_app; split; [auto |].
    constructor; [exact I |]. apply Forall_app; split; [auto | repeat constructor].
Qed.

Lemma tokens_good f : fits ns f -> Forall good_token (tokens ns f).
Proof.
  induction f as [| | r | c a b | f IHf | f IHf g IHg | f IHf g IHg | f IHf g IHg
    | f IHf g IHg | f IHf g IHg]; intros Fi; cbn [tokens fits] in *;
    try (destruct Fi; constructor; [exact I |]; apply Forall_app; split;
         [auto using term_tokens_good |]; constructor; [exact I |]; apply Forall_app; split;
         [auto using term_tokens_good | repeat constructor]).
  - constructor; [right; left; reflexivity | constructor].
  - constructor; [right; right; reflexivity | constructor].
  - constructor; [eapply ref_good; eauto | constructor].
  - constructor; [exact I |]. constructor; [exact I |]. apply Forall_app; split; [auto | repeat constructor].
Qed.

Theorem formula_spaced f : fits ns f -> formula ns (spaced (tokens ns f)) = Some f.
Proof.
  intros Fi. unfold formula. rewrite lex_spaced by (auto using tokens_good).
  pose proof (need_length f) as L. pose proof (read_form f Fi) as R.
  set (ts := tokens ns f) in *. replace (2 * S (length ts))%nat with (S (S (2 * length ts))) by lia.
  rewrite <- (app_nil_r ts) at 2. rewrite R by lia.
  destruct (2 * length ts)%nat eqn:Z; [lia |]. reflexivity.
Qed.

Lemma formulas_spaced fs : (forall f, In f fs -> fits ns f) ->
  formulas ns (map (fun f => spaced (tokens ns f)) fs) = Some fs.
Proof.
  induction fs as [| f fs IH]; intros A; [reflexivity |]. cbn [map formulas].
  rewrite formula_spaced, IH; auto; [intros; apply A; right; auto | apply A; left; auto].
Qed.
End Reading.

(** * Declarations *)

Lemma declared_good d : good_declared d -> Forall good_token (declared_tokens d).
Proof.
  destruct d as ((w, truth), (lo, hi)). intros (G & _). constructor; [left; exact G |].
  destruct truth; repeat constructor.
Qed.

Lemma declaration_text d : good_declared d -> declaration (declared_text d) = Some d.
Proof.
  intros G. unfold declaration, declared_text. rewrite lex_spaced by (auto using declared_good).
  destruct d as ((w, truth), (lo, hi)), G as ((_ & _ & R) & B & L). cbn [fst snd] in *.
  cbn [declared_tokens]. rewrite R. apply N.leb_le in L.
  destruct truth; [rewrite B; auto | rewrite L; reflexivity].
Qed.

Lemma declarations_text ds : NoDup (map (fun d => fst (fst d)) ds) ->
  (forall d, In d ds -> good_declared d) ->
  declarations (map declared_text ds) = Some ds.
Proof.
  induction ds as [| d ds IH]; intros D A; [reflexivity |]. cbn [map declarations].
  inversion D as [| ? ? N D']; subst.
  rewrite declaration_text, IH; auto; [| intros; apply A; right; auto | apply A; left; auto].
  destruct (existsb (fun e => same (fst (fst d)) (fst (fst e))) ds) eqn:E; [| reflexivity].
  exfalso. apply existsb_exists in E as (e & I & S). apply same_ok in S. apply N. rewrite S.
  change (fst (fst e)) with ((fun d : declared => fst (fst d)) e). apply in_map; auto.
Qed.

(** * Lines *)

Definition visible (c : N) : bool := (33 <=? c) && (c <=? 126).
Definition printable (c : N) : bool := (32 <=? c) && (c <=? 126).

Lemma visible_name c : is_letter c || is_digit c = true -> visible c = true.
Proof.
  unfold is_letter, is_digit, visible. rewrite !orb_true_iff, !andb_true_iff, !N.leb_le, N.eqb_eq.
  lia.
Qed.

Lemma visible_all w : forallb (fun c => is_letter c || is_digit c) w = true -> forallb visible w = true.
Proof. rewrite !forallb_forall. intros H c I. apply visible_name, H, I. Qed.

Lemma visible_decimal n : forallb visible (decimal n) = true.
Proof.
  pose proof (decimal_digits n) as D. rewrite forallb_forall in *. intros c I.
  apply visible_name. rewrite (D c I). apply orb_true_r.
Qed.

Lemma visible_token t : good_token t -> forallb visible (spelled t) = true.
Proof.
  destruct t as [n | w primed | o | | | | |]; intros G; cbn [spelled]; try reflexivity.
  - apply visible_decimal.
  - apply word_name in G as (_ & A). apply visible_all in A. destruct primed; auto.
    rewrite forallb_app, A. reflexivity.
  - destruct o as [| | | | | c |]; try destruct c; reflexivity.
Qed.

(** A line without blanks at its ends. *)
Definition tight (l : text) : Prop :=
  forallb printable l = true /\ (exists c w, l = c :: w /\ visible c = true) /\
  (exists w c, l = w ++ [c] /\ visible c = true).

Lemma visible_printable w : forallb visible w = true -> forallb printable w = true.
Proof.
  rewrite !forallb_forall. intros H c I. specialize (H c I). unfold visible, printable in *.
  rewrite !andb_true_iff, !N.leb_le in *. lia.
Qed.

Lemma visible_tight c w : forallb visible (c :: w) = true -> tight (c :: w).
Proof.
  intros V. split; [apply visible_printable; auto | split].
  - exists c, w. split; auto. cbn in V. apply andb_true_iff in V; tauto.
  - destruct (exists_last (l := c :: w) ltac:(discriminate)) as (w' & c' & E). exists w', c'.
    rewrite E in *. split; auto. rewrite forallb_app in V. cbn in V.
    rewrite !andb_true_iff in V; tauto.
Qed.

Lemma spaced_tight ts : Forall good_token ts -> ts <> [] -> tight (spaced ts).
Proof.
  induction ts as [| t ts IH]; intros G N; [congruence |]. inversion G as [| ? ? Gt Gs]; subst.
  destruct (spelled_some t Gt) as (c & w & E). pose proof (visible_token t Gt) as V. rewrite E in V.
  destruct ts as [| u ts].
  - cbn [spaced]. rewrite E. apply visible_tight; auto.
  - change (spaced (t :: u :: ts)) with (spelled t ++ 32 :: spaced (u :: ts)).
    destruct (IH Gs ltac:(discriminate)) as (P & _ & (w' & c' & E' & V')). split; [| split].
    + rewrite forallb_app, E. rewrite (visible_printable _ V). exact P.
    + rewrite E. exists c, (w ++ 32 :: spaced (u :: ts)). cbn in V. apply andb_true_iff in V.
      split; [reflexivity | tauto].
    + exists (spelled t ++ 32 :: w'), c'. rewrite E', <- app_assoc. auto.
Qed.

Lemma visible_no_space c : visible c = true -> is_space c = false.
Proof.
  unfold visible, is_space. rewrite andb_true_iff, !N.leb_le, !orb_false_iff, !N.eqb_neq. lia.
Qed.

Lemma strip_tight l : tight l -> strip l = l.
Proof.
  intros (_ & (c & w & E & V) & (w' & c' & E' & V')). unfold strip, rev'. rewrite <- !rev_alt.
  apply visible_no_space in V, V'.
  assert (forall a x, is_space a = false -> snd (span is_space (a :: x)) = a :: x) as S.
  { intros a x N. cbn. rewrite N. reflexivity. }
  rewrite E at 1. rewrite S, <- E by auto. rewrite E', rev_app_distr. cbn [rev app].
  rewrite S by auto. cbn [rev]. rewrite rev_involutive. reflexivity.
Qed.

Lemma lines_some s : lines s <> [].
Proof. destruct s as [| c s]; cbn; [discriminate |]. destruct (lines s); [| destruct (c =? 10)]; discriminate. Qed.

Lemma printable_not_10 c : printable c = true -> c =? 10 = false.
Proof. unfold printable. rewrite andb_true_iff, !N.leb_le, N.eqb_neq. lia. Qed.

Lemma lines_one l : forallb printable l = true -> lines l = [l].
Proof.
  induction l as [| c l IH]; intros P; [reflexivity |]. cbn in P |- *.
  apply andb_true_iff in P as (C & P). rewrite IH, printable_not_10; auto.
Qed.

Lemma lines_app l s : forallb printable l = true -> lines (l ++ 10 :: s) = l :: lines s.
Proof.
  induction l as [| c l IH]; intros P.
  - cbn. destruct (lines s) eqn:E; [destruct (lines_some s E) | reflexivity].
  - cbn in P |- *. apply andb_true_iff in P as (C & P). rewrite IH, printable_not_10; auto.
Qed.

Lemma lines_unlines ls : ls <> [] -> Forall tight ls -> lines (unlines ls) = ls.
Proof.
  induction ls as [| l ls IH]; intros N A; [congruence |]. inversion A as [| ? ? T A']; subst.
  destruct T as (P & _). destruct ls as [| m ls]; [apply lines_one; auto |].
  change (unlines (l :: m :: ls)) with (l ++ 10 :: unlines (m :: ls)).
  rewrite lines_app, IH; auto. discriminate.
Qed.

Lemma plain_ok s : forallb (fun c => printable c || (c =? 10)) s = true -> plain s = true.
Proof.
  induction s as [| c s IH]; intros P; [reflexivity |]. cbn [forallb] in P.
  apply andb_true_iff in P as (C & P). cbn [plain]. assert (foreign (c :: s) = false) as ->; [| auto].
  unfold printable in C. rewrite orb_true_iff, andb_true_iff, !N.leb_le, N.eqb_eq in C.
  unfold foreign. destruct (N.eqb_spec c 13); [lia |]. destruct (N.eqb_spec c 194); [lia |].
  destruct (N.eqb_spec c 226); [lia |]. rewrite orb_false_iff, !andb_false_iff, N.ltb_ge, N.eqb_neq.
  rewrite !negb_false_iff, !N.eqb_eq. lia.
Qed.

Lemma plain_unlines ls : Forall tight ls -> plain (unlines ls) = true.
Proof.
  intros A. apply plain_ok. induction ls as [| l ls IH]; [reflexivity |].
  inversion A as [| ? ? (P & _) A']; subst.
  assert (forallb (fun c => printable c || (c =? 10)) l = true) as Q.
  { rewrite forallb_forall in *. intros c I. rewrite (P c I). reflexivity. }
  destruct ls as [| m ls]; [exact Q |].
  change (unlines (l :: m :: ls)) with (l ++ 10 :: unlines (m :: ls)).
  rewrite forallb_app, Q. cbn [forallb andb]. rewrite IH; auto.
Qed.

(** * Sections *)

Definition speaks (l : text) : Prop := exists c w, l = c :: w /\ c <> 35 /\ c <> 91.

Lemma token_speaks t : good_token t -> speaks (spelled t).
Proof.
  destruct t as [n | w primed | o | | | | |]; intros G; cbn [spelled];
    try (eexists; eexists; split; [reflexivity | split; discriminate]).
  - destruct (decimal_some n) as (d & ds & E). pose proof (decimal_digits n) as D. rewrite E in *.
    cbn in D. apply andb_true_iff in D as (D & _). unfold is_digit in D.
    rewrite andb_true_iff, !N.leb_le in D. exists d, ds. split; [auto | lia].
  - apply word_name in G as (H & _). destruct w as [| c w]; [destruct H |].
    unfold is_letter in H. rewrite !orb_true_iff, !andb_true_iff, !N.leb_le, N.eqb_eq in H.
    destruct primed; [exists c, (w ++ [39]) | exists c, w]; (split; [reflexivity | lia]).
  - destruct o as [| | | | | c |]; try destruct c;
      eexists; eexists; (split; [reflexivity | split; discriminate]).
Qed.

Lemma spaced_speaks ts : Forall good_token ts -> ts <> [] -> speaks (spaced ts).
Proof.
  destruct ts as [| t ts]; intros G N; [congruence |]. inversion G as [| ? ? Gt _]; subst.
  destruct (token_speaks t Gt) as (c & w & E & S).
  destruct ts as [| u ts]; cbn [spaced]; rewrite E; [exists c, w | exists c, (w ++ 32 :: spaced (u :: ts))]; auto.
Qed.

Lemma sorted_statement x l ls : speaks l -> sorted (Some x) (l :: ls) =
  match sorted (Some x) ls with Some rest => Some ((x, l) :: rest) | None => None end.
Proof.
  intros (c & w & -> & A & B). destruct c as [| p]; [reflexivity |].
  do 7 (destruct p as [p | p |]; try reflexivity; try congruence).
Qed.

Lemma sorted_statements x ls rest r : Forall speaks ls -> sorted (Some x) rest = Some r ->
  sorted (Some x) (ls ++ rest) = Some (map (pair x) ls ++ r).
Proof.
  intros A E. induction ls as [| l ls IH]; [exact E |]. inversion A; subst.
  cbn [app map]. rewrite sorted_statement, IH; auto.
Qed.

Lemma sorted_parts (ps : list (section * text * list text)) : forall at_,
  Forall (fun p => lookup titles (snd (fst p)) = Some (fst (fst p)) /\ hd 0 (snd (fst p)) = 91 /\
                   Forall speaks (snd p)) ps ->
  sorted at_ (flat_map (fun p => snd (fst p) :: snd p) ps) =
  Some (flat_map (fun p => map (pair (fst (fst p))) (snd p)) ps).
Proof.
  induction ps as [| ((x, t), ls) ps IH]; intros at_ A; [reflexivity |].
  inversion A as [| ? ? (E & H & S) A']; subst. cbn [fst snd] in *. cbn [flat_map fst snd app].
  destruct t as [| c t]; [discriminate |]. cbn in H. subst c.
  change (sorted at_ ((91 :: t) :: ?l)) with
    (match lookup titles (91 :: t) with Some x => sorted (Some x) l | None => None end).
  rewrite E. apply sorted_statements; auto.
Qed.

Lemma of_pairs x y l r : of x (map (pair y) l ++ r) = (if section_beq x y then l else []) ++ of x r.
Proof.
  unfold of. rewrite filter_app, map_app. f_equal.
  destruct (section_beq x y) eqn:E; induction l as [| a l IH]; cbn; rewrite ?E; cbn; auto; f_equal; auto.
Qed.

(** * The round trip *)

Theorem parse_print sp ds : good sp ds ->
  parse (print sp ds) = Some (sp, map fst ds).
Proof.
  intros (R & L & D & N & Fi). set (ns := map fst ds).
  assert (NoDup (map fst ns)) as D' by (unfold ns; rewrite map_map; auto).
  assert (forall w b, In (w, b) ns -> good_name w) as G.
  { intros w b I. unfold ns in I. apply in_map_iff in I as (d & E & I).
    replace w with (fst (fst d)) by (rewrite E; auto). apply N; auto. }
  assert (forall f, fits ns f -> tight (spaced (tokens ns f)) /\ speaks (spaced (tokens ns f))) as Tf.
  { intros f F. pose proof (tokens_good ns G f F) as Gt.
    assert (tokens ns f <> []) as So by (destruct f; discriminate).
    split; [apply spaced_tight | apply spaced_speaks]; auto. }
  assert (forall d, In d ds -> tight (declared_text d) /\ speaks (declared_text d)) as Td.
  { intros d I. pose proof (declared_good d (N d I)) as Gt.
    assert (declared_tokens d <> []) as So by (destruct d as ((w, truth), (lo, hi)); discriminate).
    split; [apply spaced_tight | apply spaced_speaks]; auto. }
  assert (forall l, In l (map declared_text (firstn (inputs sp) ds)) \/
                    In l (map declared_text (skipn (inputs sp) ds)) -> tight l /\ speaks l) as Tds.
  { intros l [I | I]; apply in_map_iff in I as (d & <- & I); apply Td;
      rewrite <- (firstn_skipn (inputs sp) ds); apply in_or_app; auto. }
  set (fs := map (fun f => spaced (tokens ns f))).
  assert (forall l fl, (forall f, In f fl -> fits ns f) -> In l (fs fl) -> tight l /\ speaks l) as Tfs.
  { intros l fl A I. apply in_map_iff in I as (f & <- & I). apply Tf, A, I. }
  assert (forall fl, (forall f, In f fl -> In f (env_init sp ++ sys_init sp ++ env_trans sp ++
            sys_trans sp ++ env_live sp ++ sys_live sp)) -> forall f, In f fl -> fits ns f) as Sub.
  { intros fl S f I. apply Fi, S, I. }
  assert (Forall (fun p => lookup titles (snd (fst p)) = Some (fst (fst p)) /\ hd 0 (snd (fst p)) = 91 /\
                   Forall (fun l => tight l /\ speaks l) (snd p)) (parts sp ds)) as P.
  { unfold parts. fold ns. fold fs.
    repeat (apply Forall_cons; [split; [reflexivity | split; [reflexivity |]]; cbn [snd]; apply Forall_forall;
      intros l I; first [apply Tds; auto; fail | eapply Tfs; [apply Sub | exact I];
        intros f J; rewrite !in_app_iff; tauto] |]). apply Forall_nil. }
  assert (Forall tight (flat_map (fun p => snd (fst p) :: snd p) (parts sp ds))) as Ti.
  { apply Forall_flat_map. revert P. apply Forall_impl. intros ((x, t), ls) (T' & H & A).
    cbn [fst snd] in *. constructor.
    - unfold titles in T'. cbn [lookup] in T'.
      repeat match type of T' with (if same ?a ?b then _ else _) = _ =>
        let E := fresh in destruct (same a b) eqn:E; [apply same_ok in E; subst t; apply visible_tight; reflexivity |]
      end. discriminate.
    - revert A. apply Forall_impl. tauto. }
  assert (forall ls, starts [239; 187; 191] (unlines (codes "[INPUT]" :: ls)) = None) as M by (intros []; reflexivity).
  unfold parse. assert (starts [239; 187; 191] (print sp ds) = None) as -> by apply M. cbv zeta. unfold print. rewrite plain_unlines by auto.
  rewrite lines_unlines by (auto; discriminate).
  replace (map strip (flat_map (fun p => snd (fst p) :: snd p) (parts sp ds)))
    with (flat_map (fun p => snd (fst p) :: snd p) (parts sp ds)).
  2: { clear - Ti. induction Ti as [| l ls T Ti IH]; [reflexivity |]. cbn. rewrite <- IH, strip_tight; auto. }
  rewrite sorted_parts.
  2: { revert P. apply Forall_impl. intros p (A & B & C). repeat split; auto.
       revert C. apply Forall_impl. tauto. }
  cbv beta iota. unfold parts. fold ns. fold fs. cbn [flat_map fst snd]. unfold parse_lines.
  rewrite !of_pairs. cbn [section_beq app]. rewrite !app_nil_r.
  change (of ?x []) with (@nil text).
  rewrite <- map_app, firstn_skipn, declarations_text by auto. cbv zeta. fold ns.
  unfold fs. rewrite !formulas_spaced by (auto; apply Sub; intros f J; rewrite !in_app_iff; tauto).
  rewrite map_length, firstn_length, Nat.min_l by auto. rewrite <- R. destruct sp. reflexivity.
Qed.
