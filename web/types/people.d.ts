// Documents of the routes of people and their rights. No browser loads this file.

/** What the server asks of whoever comes, and who this browser is to it. */
export type SignInDocument = {
  mode: "open" | "token" | "users" | "first_admin";
  name: string | null;
  kind: "local" | "shared_token" | "user" | "service" | "nobody";
  role: "viewer" | "operator" | "admin" | null;
  rights: ("view" | "operate" | "administer")[];
  expires_utc: string | null;
};
export type UserDocument = {
  name: string;
  role: "viewer" | "operator" | "admin";
  state: "active" | "invited" | "disabled";
  created_utc: string;
  last_seen_utc: string | null;
  locked_for_s: number | null;
};
/** `path`: of this server; it works once. */
export type InvitationDocument = { path: string; expires_utc: string };
export type UserCreated = { user: UserDocument; invitation: InvitationDocument | null };
export type UserSessionDocument = {
  id: string;
  user: string;
  address: string;
  browser: string;
  created_utc: string;
  last_seen_utc: string;
  expires_utc: string;
  current: boolean;
  streams: number;
};
export type ServiceTokenDocument = {
  id: string;
  name: string;
  prefix: string;
  scopes: ("view" | "operate" | "administer")[];
  created_by: string;
  created_utc: string;
  expires_utc: string | null;
  last_used_utc: string | null;
};
export type ServiceTokenCreated = { token: string; document: ServiceTokenDocument };
export type AuditDocument = {
  id: number;
  utc: string;
  who: string;
  kind: SignInDocument["kind"];
  method: string;
  path: string;
  what: string;
  address: string;
  status: number;
  outcome: "done" | "refused" | "failed";
  repeated: number;
  detail: string;
};
export type AuditPage = { entries: AuditDocument[]; next_before: number | null };
