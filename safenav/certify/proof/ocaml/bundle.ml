(* From the files of a bundle to evidence in the terms of the proved checker. What is read wrongly
   here is refused there, or another strategy, map or circumstance is judged than is said: see
   docs/proof.md, "What is trusted". *)
open Proved

exception Not_covered of string

let ( / ) = Filename.concat
let has file = Sys.file_exists file
let read file =
  let c = open_in_bin file in
  Fun.protect ~finally:(fun () -> close_in c) (fun () -> really_input_string c (in_channel_length c))
let json file = Json.parse (read file)

(* Numbers as Coq has them; small ones are made once. *)
let rec pos k = if k = 1 then XH else if k land 1 = 1 then XI (pos (k lsr 1)) else XO (pos (k lsr 1))
let small = Array.init 4096 (fun k -> if k = 0 then N0 else Npos (pos k))
let num k = if k < 0 then raise (Json.Bad "a number is below 0") else if k < 4096 then small.(k) else Npos (pos k)
let rec nat k = if k <= 0 then O else S (nat (k - 1))
let rec unpos = function XH -> 1 | XO p -> 2 * unpos p | XI p -> (2 * unpos p) + 1
let unnum = function N0 -> 0 | Npos p -> unpos p
let bytes s = List.init (String.length s) (fun k -> num (Char.code s.[k]))
let unbytes l = String.of_seq (Seq.map (fun n -> Char.chr (unnum n)) (List.to_seq l))
let named = Hashtbl.create 1000  (* so that all edges to a node share its name *)
let name k = match Hashtbl.find_opt named k with
  | Some p -> p
  | None -> let p = pos (k + 1) in Hashtbl.replace named k p; p
let ints v = List.map Json.int (Json.list v)
let nums v = List.map num (ints v)

(* A specification: its bytes, and of each variable its name and least value, to read strategies. *)
type text = { bytes : n list; meaning : spec; heads : (string * int) list }
let text file =
  let bytes = bytes (read file) in
  match parse bytes with
  | None -> raise (Json.Bad "the text of the specification is not understood")
  | Some (meaning, names) ->
      { bytes; meaning; heads = List.map2 (fun n (lo, _) -> unbytes n, unnum lo) names meaning.ranges }

(* Nodes: number, values of the variables (the bits of one, the lowest first, hold value - least),
   successors. *)
type listed = { number : int; values : n list; after : int list }
let nodes text doc =
  let bit v = List.hd (String.split_on_char '@' (Json.str v)) in
  let bits = Array.of_list (List.map bit (Json.list (Json.field "variables" doc))) in
  let at = List.map (fun (name, least) ->
    List.filter (fun k -> bits.(k) = name) (List.init (Array.length bits) Fun.id), least) text.heads in
  let node (key, v) =
    let state = Array.of_list (ints (Json.field "state" v)) in
    if Array.length state <> Array.length bits || Array.exists (fun b -> b <> 0 && b <> 1) state then
      raise (Json.Bad ("the bits of node " ^ key));
    let value (ks, least) = num (List.fold_right (fun k n -> (2 * n) + state.(k)) ks 0 + least) in
    { number = int_of_string key; values = List.map value at; after = ints (Json.field "trans" v) } in
  let all = List.map node (Json.pairs (Json.field "nodes" doc)) in
  List.sort (fun a b -> compare a.number b.number) all

(* Measures are written for the first of twins (docs/certificates.md): nodes with the same
   successors that differ only in inputs busy_... whose present value no formula reads. *)
let first text listed =
  let sp = text.meaning and read = Hashtbl.create 16 in
  let rec term = function Ref (Now x) -> Hashtbl.replace read x () | Add (a, b) -> term a; term b | _ -> () in
  let rec form = function
    | Truth (Now x) -> Hashtbl.replace read x () | Cmp (_, a, b) -> term a; term b | Not f -> form f
    | And (f, g) | Or (f, g) | Imp (f, g) | Iff (f, g) | Xor (f, g) -> form f; form g | _ -> () in
  List.iter (List.iter form) [sp.env_trans; sp.sys_trans; sp.env_live; sp.sys_live];
  let passes x (name, _) = String.starts_with ~prefix:"busy_" name && not (Hashtbl.mem read (nat x)) in
  let passing = List.mapi passes text.heads in
  let known = Hashtbl.create 1000 and first = Hashtbl.create 1000 in
  List.iter (fun u ->
    let values = List.filter_map Fun.id (List.map2 (fun n p -> if p then None else Some (unnum n)) u.values passing) in
    let key = Digest.string (Marshal.to_string (values, u.after) [Marshal.No_sharing]) in
    if not (Hashtbl.mem known key) then Hashtbl.replace known key u.number;
    Hashtbl.replace first u.number (Hashtbl.find known key)) listed;
  Hashtbl.find first

(* Ranks of each node: a number, and perhaps the number of an excuse. *)
let ranks doc =
  let array f m key = Array.of_list (List.map f (Json.list (Json.field key m))) in
  let each = List.map (fun m -> array Json.int m "n", array (Json.opt Json.int) m "a") (Json.list doc) in
  fun k -> List.map (fun (n, a) ->
    if k >= Array.length n || k >= Array.length a then raise (Json.Bad "too few ranks");
    num n.(k), Option.map nat a.(k)) each

let made build listed =
  List.fold_left (fun g u -> PositiveMap.add (name u.number) (build u) g) PositiveMap.empty listed

(* Number of steps from each node to an edge that meets an assumption, by backward search. *)
let bounds sp listed =
  let count = List.length listed and node = Hashtbl.create 1000 and before = Hashtbl.create 1000 in
  List.iter (fun u -> Hashtbl.replace node u.number u; List.iter (fun v -> Hashtbl.add before v u.number) u.after) listed;
  let state u = let row = Array.of_list u.values in
    let rec at k = function O -> row.(k) | S x -> at (k + 1) x in at 0 in
  let bound aim =
    let found = Hashtbl.create count and queue = Queue.create () in
    let add u k = if not (Hashtbl.mem found u) then (Hashtbl.replace found u k; Queue.add u queue) in
    let meets u v = match Hashtbl.find_opt node v with Some v -> sat (state u) (state v) aim | None -> false in
    List.iter (fun u -> if List.exists (meets u) u.after then add u.number 0) listed;
    while not (Queue.is_empty queue) do
      let v = Queue.pop queue in
      List.iter (fun u -> add u (Hashtbl.find found v + 1)) (Hashtbl.find_all before v)
    done;
    fun u -> num (Option.value ~default:0 (Hashtbl.find_opt found u)) in
  let each = List.map bound (aims sp) in
  fun u -> List.map (fun b -> b u) each

type strategy = { of_text : text; listed : listed list; graph : graph }
let strategy b spec graph =
  let of_text = text (b / "specs" / (spec ^ ".structuredslugs")) in
  let listed = nodes of_text (json (b / "strategies" / (graph ^ ".json"))) in
  let rank = ranks (json (b / "measures" / (spec ^ "-" ^ graph ^ ".json"))) in
  let first = first of_text listed and ahead = bounds of_text.meaning listed in
  let build u = { row = u.values; next = List.map name u.after; rank_of = rank (first u.number); ahead = ahead u.number } in
  { of_text; listed; graph = made build listed }

(* Evidence concerns reachable nodes only; the others are omitted. *)
let counterstrategy b spec =
  let of_text = text (b / "specs" / (spec ^ ".structuredslugs")) in
  let doc = json (b / "counterstrategies" / (spec ^ ".json")) in
  let start = nums (Json.field "start" doc) and rank = ranks (Json.field "measures" doc) in
  let chosen = Array.of_list (List.map nums (Json.list (Json.field "chosen" doc))) in
  let listed = nodes of_text (Json.field "automaton" doc) in
  let first = first of_text listed in
  let build u = { base = { row = u.values; next = List.map name u.after; rank_of = rank (first u.number); ahead = [] };
                  chosen = chosen.(first u.number) } in
  let after = Hashtbl.create 100 and reached = Hashtbl.create 100 in
  List.iter (fun u -> Hashtbl.replace after u.number u.after) listed;
  let rec visit k = if not (Hashtbl.mem reached k) then begin
    Hashtbl.replace reached k (); List.iter visit (Option.value ~default:[] (Hashtbl.find_opt after k)) end in
  let starts u = List.filteri (fun x _ -> x < List.length start) u.values = start in
  List.iter (fun u -> if starts u && begins of_text.meaning (build u).base then visit u.number) listed;
  of_text, List.filter (fun u -> Hashtbl.mem reached u.number) listed, build, start

(* The scenario, and the circumstances of a strategy, from its line of the trace. *)
let world scenario =
  let grid = List.map Json.str (Json.list (Json.field "grid" (Json.field "map" scenario))) in
  let columns = String.length (List.hd grid) in
  if List.exists (fun r -> String.length r <> columns) grid then raise (Json.Bad "rows of different lengths");
  { columns = num columns; cells = List.concat_map (fun r -> List.init columns (fun k -> r.[k] = '.')) grid }

type robot = { index : int; name : string; data : Json.t }
let robots scenario =
  List.mapi (fun index (name, data) -> { index; name; data }) (Json.pairs (Json.field "robots" scenario))

let optional key v = try Json.list (Json.field key v) with Json.Bad _ -> []
let words key v = List.map Json.str (optional key v)

(* Pairs of robots in conflict: either robot may list the other. *)
let pairs robots =
  let index name = match List.find_opt (fun r -> r.name = name) robots with
    | Some r -> r.index | None -> raise (Json.Bad ("no robot " ^ name)) in
  List.concat_map (fun r -> List.map (fun o -> nat r.index, nat (index o)) (words "conflicts" r.data)) robots

let starts robots = List.map (fun r -> num (Json.int (Json.field "start" r.data))) robots

(* [others]: robots to whose known positions it must not step. *)
let circumstances robot line =
  let nearby = Json.str (Json.field "tracking" robot.data) = "nearby" in
  let closed = List.map (fun c -> num (Json.int (List.hd (Json.list c)))) (optional "closed" line) in
  let moving = words "moving" line in
  { closed; turns = Json.str (Json.field "mobility" robot.data) = "heading";
    others = if nearby then [] else List.map (fun n -> bytes ("at_" ^ n)) moving }, List.length moving

(* None are claimed with assignable goals: while the robot is sent somewhere its own can wait. *)
let targets line = match Json.field "objective" line with
  | _ when Json.field_opt "places" line <> None -> []
  | objective -> List.concat_map (fun kind ->
      List.map (function Json.Arr rs -> List.map (fun r -> num (Json.int r)) rs | r -> [num (Json.int r)])
        (optional kind objective)) ["patrol"; "circuit"; "visit"; "cover"]

(* The lines of the trace about syntheses, each with its number. *)
let syntheses b =
  let file = b / "trace.jsonl" in
  let lines = if has file then String.split_on_char '\n' (read file) else [] in
  List.concat (List.mapi (fun k line ->
    if line = "" then [] else
    let line = Json.parse line in
    if Json.field "type" line = Json.Str "synthesis" then [k + 1, line] else []) lines)
