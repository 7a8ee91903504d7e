(* From files to certificates in the terms of the proved checker. What is read wrongly here is refused
   there, or another strategy is judged than the file contains: see docs/proof.md. *)
open Proved

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
let unnum n =
  let k = match n with N0 -> 0 | Npos p -> unpos p in
  if num k = n then k else raise (Json.Bad "a number is too large")
let bytes s = List.init (String.length s) (fun k -> num (Char.code s.[k]))
let unbytes l = String.of_seq (Seq.map (fun n -> Char.chr (unnum n)) (List.to_seq l))
let named = Hashtbl.create 1000  (* so that all edges to a node share its name *)
let name k = match Hashtbl.find_opt named k with
  | Some p -> p
  | None -> let p = pos (k + 1) in Hashtbl.replace named k p; p
let ints v = List.map Json.int (Json.list v)
let nums v = List.map num (ints v)

(* The names of a variable's bits as slugs prints them, the lowest first, and its least value; the bits
   of a number hold value - least. *)
let bits (name, truth) (least, most) =
  let name = unbytes name and least = unnum least and most = unnum most in
  let rec width k = if k = 0 then 0 else 1 + width (k lsr 1) in
  let bit k = if k = 0 then Printf.sprintf "%s@0.%d.%d" name least most else Printf.sprintf "%s@%d" name k in
  (if truth then [name] else List.init (width (most - least)) bit), least

(* A specification: its bytes, and the bits of each variable, to read strategies. *)
type text = { bytes : n list; meaning : spec; bits : (string list * int) list }
let text file =
  let bytes = bytes (read file) in
  match parse bytes with
  | None -> raise (Json.Bad "the text of the specification is not understood")
  | Some (meaning, names) -> { bytes; meaning; bits = List.map2 bits names meaning.ranges }

(* Nodes: number, values of the variables, successors. *)
type listed = { number : int; values : n list; after : int list }
let nodes text doc =
  let names = List.map Json.str (Json.list (Json.field "variables" doc)) in
  if List.sort compare names <> List.sort compare (List.concat_map fst text.bits) then
    raise (Json.Bad "the variables are not the bits of the specification's");
  let columns = List.mapi (fun k name -> name, k) names in
  let at = List.map (fun (own, least) -> List.map (fun b -> List.assoc b columns) own, least) text.bits in
  let all = Hashtbl.of_seq (List.to_seq (Json.pairs (Json.field "nodes" doc))) in
  List.init (Hashtbl.length all) (fun number ->
    let v = Hashtbl.find all (string_of_int number) in
    let state = Array.of_list (ints (Json.field "state" v)) in
    if Array.length state <> List.length names || Array.exists (fun b -> b <> 0 && b <> 1) state then
      raise (Json.Bad (Printf.sprintf "the bits of node %d" number));
    let value (ks, least) = num (List.fold_right (fun k n -> (2 * n) + state.(k)) ks 0 + least) in
    { number; values = List.map value at; after = ints (Json.field "trans" v) })

(* Ranks of each node: a number, and perhaps the number of an excuse. *)
let ranks doc =
  let array f m key = Array.of_list (List.map f (Json.list (Json.field key m))) in
  let each = List.map (fun m -> array Json.int m "n", array (Json.opt Json.int) m "a") (Json.list doc) in
  fun k -> List.map (fun (n, a) ->
    if k >= Array.length n || k >= Array.length a then raise (Json.Bad "too few ranks");
    num n.(k), Option.map nat a.(k)) each

let made build listed =
  List.fold_left (fun g u -> PositiveMap.add (name u.number) (build u) g) PositiveMap.empty listed

(* The nodes that are reached from some nodes. *)
let reached listed begins =
  let after = Hashtbl.create 1000 and found = Hashtbl.create 1000 in
  List.iter (fun u -> Hashtbl.replace after u.number u.after) listed;
  let rec visit = function
    | [] -> ()
    | k :: rest when Hashtbl.mem found k -> visit rest
    | k :: rest -> Hashtbl.replace found k ();
        visit (List.rev_append (Option.value ~default:[] (Hashtbl.find_opt after k)) rest) in
  visit (List.filter_map (fun u -> if begins u then Some u.number else None) listed);
  List.filter (fun u -> Hashtbl.mem found u.number) listed

let node rank u = { row = u.values; next = List.map name u.after; rank_of = rank u.number }

type strategy = { listed : listed list; graph : graph }
let strategy text document measures =
  let build = node (ranks (Json.field "measures" measures)) in
  let listed = nodes text document in
  { listed; graph = made build listed }

(* Evidence concerns reachable nodes only. [build]: a node with the environment's choice. *)
type counterstrategy = { members : listed list; build : listed -> cnode; cgraph : cgraph; start : n list }
let counterstrategy text document measures =
  let start = nums (Json.field "start" measures) and rank = ranks (Json.field "measures" measures) in
  let chosen = Array.of_list (List.map nums (Json.list (Json.field "chosen" measures))) in
  let build u = { base = node rank u; chosen = chosen.(u.number) } in
  let starts u = List.filteri (fun x _ -> x < List.length start) u.values = start in
  let members = nodes text document in
  let members = reached members (fun u -> starts u && begins text.meaning (build u).base) in
  { members; build; cgraph = made build members; start }
